import { memo, useEffect, useRef } from "react";
import { inLanguage, useTexts } from "../i18n";
import { openMat, saveMat } from "../projects/actions";
import { chooseKind } from "../projects/project";
import { openDialog } from "../state/dialogs";
import { endEdit } from "../state/history";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { setRange, startHere } from "./actions";
import { carsOf, followersAt, MOST_FOLLOWERS, MOST_ONE_BY_ONE, positionOf, ROOM_TO_SPARE, withFollowers } from "./cars";
import { FLOOR_NAMES, floorOf, lossOf, type Mat } from "./document";
import { withLoss } from "./edits";
import { session } from "./session";
import { editMat, useMat } from "./store";
import { Choice, NumberBox, NumberSlider, ToolButton, ToolSwitch } from "../ui/fields";
import fields from "../ui/fields.module.css";

const MOST_LOSS = 0.95;
const MOST_RANGE_MM = 5000;
/** What the world answers where a crowd doesn't fit. */
const CROWDED = new Set(["crowd-has-no-room", "starts-too-close"]);
const MOST_SPARE = 60;
const MOST_SEED = 2 ** 32 - 1;

export const CarsPanel = memo(function CarsPanel() {
  const t = useTexts();
  const mat = useStudio((studio) => studio.mat);
  const inMission = useStudio(({ mission }) => mission !== null);
  const { tracks, air, hello } = useMat();
  const caption = useSettings((settings) => settings.caption);
  return (
    <div className={fields.swarm}>
      {inMission ? <p>{t("missions.matStays")}</p> : <Conditions />}
      <div className="wrap">
        <span>{t("mat.floor")}</span>
        <Choice
          label={t("mat.floor")}
          value={floorOf(mat)}
          all={FLOOR_NAMES}
          name={(each) => t(`mat.floors.${each}`)}
          onChange={(floor) => editMat({ ...mat, floor })}
        />
      </div>
      <div className="wrap">
        <ToolSwitch label={t("mat.tracks")} isSelected={tracks} onChange={(on) => useMat.setState({ tracks: on })} />
        <ToolSwitch label={t("mat.air")} isSelected={air} onChange={(on) => useMat.setState({ air: on })} />
        <ToolSwitch label={t("mat.account.title")} isSelected={caption} onChange={(on) => useSettings.setState({ caption: on })} />
      </div>
      {!inMission && (
        <ToolButton
          icon="present"
          label={t("mat.startHere")}
          wide
          isDisabled={!hello || hello.cars > MOST_ONE_BY_ONE}
          onPress={startHere}
        />
      )}
      <div className="wrap">
        {!inMission && <ToolButton icon="file" label={t("mat.open")} wide onPress={() => void openMat()} />}
        <ToolButton icon="download" label={t("mat.save")} wide onPress={saveMat} />
      </div>
    </div>
  );
});

/** What a mission fixes: how many cars there are, and how messages reach them. */
function Conditions() {
  const t = useTexts();
  const mat = useStudio((studio) => studio.mat);
  const rangeMm = useStudio((studio) => studio.rangeMm);
  const hello = useMat((now) => now.hello);
  return (
    <>
      <Followers />
      <NumberSlider
        label={t("mat.loss")}
        value={Math.round(lossOf(mat) * 100) / 100}
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
        onChange={setRange}
        onEnd={endEdit}
      />
      <Seed />
      <Kind />
    </>
  );
}

/** The choice of the car that was measured; no profile has this name. */
const OWN = "own car";

/** Which cars these are: those of a profile, or the one that was measured. */
function Kind() {
  const t = useTexts();
  const profiles = useStudio((studio) => studio.profiles);
  const profile = useStudio((studio) => studio.profile);
  const car = useStudio((studio) => studio.car);
  const ownCar = useSettings((settings) => settings.ownCar);
  const own = car ?? ownCar;
  const titles = new Map(profiles.map(({ name, title }) => [name, inLanguage(title)]));
  return (
    <div className="wrap">
      <span>{t("mat.kind")}</span>
      <Choice
        label={t("mat.kind")}
        value={car ? OWN : profile}
        all={[...titles.keys(), ...(own ? [OWN] : [])]}
        name={(each) => titles.get(each) ?? t("mat.ownCar")}
        onChange={(chosen) => (chosen === OWN ? chooseKind(profile, own) : chooseKind(chosen, null))}
      />
      <ToolButton icon="settings" label={t("menu.calibrate")} wide onPress={() => openDialog("calibration")} />
    </div>
  );
}

/** While the slider moves, each number is made from the mat of its beginning: one that grew for 1,000 cars shrinks again. */
function Followers() {
  const t = useTexts();
  const mat = useStudio(({ mat }) => mat);
  const mostCars = useStudio(({ capabilities }) => capabilities?.most_cars ?? MOST_FOLLOWERS);
  const base = useRef<{ from: Mat; made: Mat; wanted: number; spare: number } | null>(null);
  const { leaders, followers } = carsOf(mat);
  const most = Math.min(MOST_FOLLOWERS, Math.max(0, mostCars - leaders));
  const scale = { positions: positionOf(most), positionOf, valueAt: (position: number) => Math.min(most, followersAt(position)) };
  const make = (from: Mat, wanted: number, spare: number) => {
    const made = withFollowers(from, wanted, spare);
    base.current = { from, made, wanted, spare };
    editMat(made, "followers");
  };
  // Walls and obstacles took more room than was reckoned with: the crowd gets more.
  useEffect(
    () =>
      useMat.subscribe(({ problem }, before) => {
        const last = base.current;
        if (!last || problem === before.problem || !problem || !CROWDED.has(problem.code)) return;
        if (last.made === useStudio.getState().mat && last.spare < MOST_SPARE) make(last.from, last.wanted, last.spare * 1.6);
      }),
    [],
  );
  return (
    <NumberSlider
      label={t("mat.followers")}
      value={Math.min(most, followers)}
      most={most}
      scale={scale}
      onChange={(wanted) => {
        const from = base.current?.made === mat ? base.current.from : mat;
        make(from, wanted, ROOM_TO_SPARE);
      }}
    />
  );
}

function Seed() {
  const t = useTexts();
  const seed = useMat((now) => now.seed);
  return (
    <NumberBox
      label={t("mat.seed")}
      value={seed}
      minValue={0}
      maxValue={MOST_SEED}
      formatOptions={{ useGrouping: false }}
      onChange={(typed) => {
        useMat.setState({ seed: typed });
        session.reset();
      }}
    />
  );
}
