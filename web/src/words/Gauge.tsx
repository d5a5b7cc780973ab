import { Button, Label, Meter } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { Costliest, EditorName } from "../api/types";
import { findText } from "../blocks/search";
import { showBlock } from "../blocks/workspaces";

interface GaugeProps {
  editor: EditorName;
  used: number;
  most: number;
  costliest: Costliest | null;
}

/** From this share of the limit on, the block that costs most is named. */
const NEAR = 0.75;

export function Gauge({ editor, used, most, costliest }: GaugeProps) {
  const { t } = useTranslation();
  const near = used >= most * NEAR;
  const block = costliest?.block;
  return (
    <div className="gauge" data-level={used > most ? "over" : near ? "near" : "fine"}>
      <Meter value={Math.min(used, most)} maxValue={most} valueLabel={t("words.used", { used, most })}>
        {({ percentage, valueText }) => (
          <>
            <Label>{t(`words.${editor}Used`)}</Label>
            <span className="gauge-bar">
              <span className={`gauge-fill ${editor}`} style={{ width: `${percentage}%` }} />
            </span>
            <span className="gauge-value">{valueText}</span>
          </>
        )}
      </Meter>
      {near && block && (
        <Button className="link" onPress={() => showBlock(editor, block)}>
          {t("words.costliest", { block: findText(editor, block), count: costliest.count })}
        </Button>
      )}
    </div>
  );
}
