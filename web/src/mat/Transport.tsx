import { memo } from "react";
import { Button, Label, ListBox, ListBoxItem, Popover, Select, SelectValue } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { clock } from "../timeline/lanes";
import { MatIcon } from "./icons";
import type { Session } from "./session";
import { useMat } from "./store";
import { ToolButton } from "./ToolButton";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];
const FRACTIONS: Record<number, string> = { 0.25: "¼", 0.5: "½" };
/** A single step that can be seen: a tick is a millisecond. */
const STEP_MS = 100;

export const Transport = memo(function Transport({ session }: { session: Session }) {
  const { t } = useTranslation();
  const playing = useMat(({ state }) => state?.playing ?? false);
  const tMs = useMat((now) => now.tMs);
  const past = useMat((now) => now.past);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const tickMs = useMat(({ hello }) => hello?.tick_ms ?? 1);
  const empty = cars === 0;
  return (
    <div className="mat-transport" role="group" aria-label={t("mat.transport")}>
      <Button
        id="mat-play"
        className="mat-button main wide"
        isDisabled={empty}
        onPress={() => (playing ? session.say({ do: "pause" }) : session.play())}
      >
        <MatIcon name={playing ? "pause" : "play"} />
        <span>{playing ? t("mat.pause") : t("mat.play")}</span>
      </Button>
      <ToolButton
        icon="step"
        label={t("mat.step")}
        isDisabled={empty}
        onPress={() => session.say({ do: "step", ticks: Math.max(1, Math.round(STEP_MS / tickMs)) })}
      />
      <ToolButton icon="reset" label={t("mat.reset")} isDisabled={empty} onPress={() => session.reset()} />
      <Speed session={session} />
      <output className="mat-clock" data-past={past || undefined} aria-label={t("mat.time")}>
        {clock(tMs)}
      </output>
      <span className="mat-say">
        <Say session={session} word="stop" label={t("mat.sayStop")} text={t("mat.stop")} isDisabled={empty} />
        <Say session={session} word="go" label={t("mat.sayGo")} text={t("mat.go")} isDisabled={empty} />
      </span>
    </div>
  );
});

interface SayProps {
  session: Session;
  word: "stop" | "go";
  label: string;
  text: string;
  isDisabled: boolean;
}

function Say({ session, word, label, text, isDisabled }: SayProps) {
  return <ToolButton icon={word} label={label} wide={text} isDisabled={isDisabled} onPress={() => session.say({ do: "say", word })} />;
}

function Speed({ session }: { session: Session }) {
  const { t } = useTranslation();
  const speed = useMat((now) => now.speed);
  return (
    <Select className="mat-select" value={String(speed)} onChange={(key) => session.setSpeed(Number(key))}>
      <Label className="visually-hidden">{t("mat.speed")}</Label>
      <Button className="mat-button wide">
        <SelectValue />
        <MatIcon name="right" />
      </Button>
      <Popover className="mat-popover">
        <ListBox>
          {SPEEDS.map((each) => (
            <ListBoxItem key={each} id={String(each)} className="mat-option" textValue={`${each}×`}>
              {`${FRACTIONS[each] ?? each}×`}
            </ListBoxItem>
          ))}
        </ListBox>
      </Popover>
    </Select>
  );
}
