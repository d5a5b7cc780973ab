import { memo, useRef } from "react";
import { Input, Label, NumberField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { startHere } from "./actions";
import { carsOf, followersAt, MOST_FOLLOWERS, MOST_ONE_BY_ONE, positionOf, SLIDER_STEPS, withFollowers } from "./cars";
import { lossOf, type Mat, withLoss } from "./document";
import { NumberSlider } from "./NumberSlider";
import type { Session } from "./session";
import { editMat, endEdit, useMat } from "./store";
import { ToolButton, ToolSwitch } from "./ToolButton";

const SCALE = { positions: SLIDER_STEPS, positionOf, valueAt: followersAt };
const MOST_LOSS = 0.95;
const MOST_RANGE_MM = 5000;
const MOST_SEED = 2 ** 32 - 1;

export const Swarm = memo(function Swarm({ session }: { session: Session }) {
  const { t } = useTranslation();
  const { mat, rangeMm, tracks, air } = useMat();
  const hello = useMat((now) => now.hello);
  const loss = lossOf(mat);
  return (
    <div className="mat-swarm">
      <Followers />
      <NumberSlider
        label={t("mat.loss")}
        value={Math.round(loss * 100) / 100}
        most={MOST_LOSS}
        step={0.01}
        format={{ style: "percent", maximumFractionDigits: 0 }}
        onChange={(share) => editMat(withLoss(mat, share), "loss")}
        onEnd={endEdit}
      />
      <NumberSlider
        label={t("mat.range")}
        value={rangeMm ?? Math.round((hello?.range_m ?? 1) * 1000)}
        least={50}
        most={MOST_RANGE_MM}
        step={50}
        format={{ style: "unit", unit: "millimeter" }}
        onChange={(range) => useMat.setState({ rangeMm: range })}
      />
      <Seed session={session} />
      <div className="mat-switches">
        <ToolSwitch label={t("mat.tracks")} isSelected={tracks} onChange={(on) => useMat.setState({ tracks: on })} />
        <ToolSwitch label={t("mat.air")} isSelected={air} onChange={(on) => useMat.setState({ air: on })} />
      </div>
      <ToolButton
        icon="present"
        label={t("mat.startHere")}
        wide
        isDisabled={!hello || hello.cars > MOST_ONE_BY_ONE}
        onPress={() => startHere(session)}
      />
    </div>
  );
});

/** Sliding works from where it began, so that a mat that grew for a thousand cars shrinks again with them. */
function Followers() {
  const { t } = useTranslation();
  const mat = useMat((now) => now.mat);
  const base = useRef<{ from: Mat; made: Mat } | null>(null);
  return (
    <NumberSlider
      label={t("mat.followers")}
      value={Math.min(MOST_FOLLOWERS, carsOf(mat).followers)}
      most={MOST_FOLLOWERS}
      scale={SCALE}
      onChange={(wished) => {
        const from = base.current?.made === mat ? base.current.from : mat;
        const made = withFollowers(from, wished);
        base.current = { from, made };
        editMat(made, "followers");
      }}
    />
  );
}

function Seed({ session }: { session: Session }) {
  const { t } = useTranslation();
  const seed = useMat((now) => now.seed);
  return (
    <NumberField
      className="mat-field beside"
      value={seed}
      minValue={0}
      maxValue={MOST_SEED}
      formatOptions={{ useGrouping: false }}
      onChange={(typed) => {
        if (Number.isNaN(typed)) return;
        useMat.setState({ seed: typed });
        session.reset();
      }}
    >
      <Label>{t("mat.seed")}</Label>
      <Input />
    </NumberField>
  );
}
