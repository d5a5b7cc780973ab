import { useEffect, useMemo } from "react";
import { StoppedNotice, ZoneCard } from "../certainty/StopTools";
import { watchStops } from "../certainty/stops";
import { trials } from "../certainty/trials";
import { inLanguage, useTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { isHeard, useStudio } from "../state/studio";
import { OutcomeOnStage } from "../missions/MissionStrip";
import { useMission } from "../missions/store";
import { endAll } from "../ui/areas";
import { BehindView } from "./BehindView";
import { danceOf } from "./moves";
import { ToolButton } from "../ui/fields";
import { DrawHint } from "./RoadTools";
import { ZoneGrips } from "../missions/ZoneGrips";
import { MatCanvas } from "./MatCanvas";
import { Narration } from "./Narration";
import { carBeside } from "./room";
import { session } from "./session";
import { choose, drawRoads, useMat } from "./store";
import { Sound } from "./sound";
import { Legend } from "./Legend";
import { Thoughts } from "./Thoughts";
import { Transport } from "./Transport";
import { CarCard } from "./Why";
import css from "./mat.module.css";

/** The mat of the open project with the cars that run its program, and what lies over it. */
export function Stage() {
  const generation = useStudio((studio) => studio.generation);
  useEffect(() => {
    choose(null);
    drawRoads(false);
  }, [generation]);
  useSound();
  useEffect(watchStops, []);
  useEffect(() => trials.watch(), []);
  return (
    <div className={css.stage}>
      <MatCanvas />
      <BehindView />
      <Thoughts />
      <ZoneGrips />
      <CarCard />
      <div className={css.top}>
        <OutcomeOnStage />
        <Notice />
        <StoppedNotice />
        <ZoneCard />
        <DrawHint />
        <Narration />
        <Legend />
      </div>
      <Transport />
    </div>
  );
}

/** Let the stage sound as long as sound is on; with stars the cars dance. */
function useSound(): void {
  useEffect(() => {
    const sound = new Sound();
    const mute = () => {
      if (!isHeard() || !useMat.getState().state?.playing) sound.silence();
    };
    return endAll(
      session.listen((picture) => {
        const { hello, state } = useMat.getState();
        sound.take(picture, new Set(hello?.leads), isHeard(), state?.playing ?? false);
      }),
      useMission.subscribe(({ result }, before) => {
        if (!result?.stars.length || result === before.result) return;
        if (isHeard()) sound.celebrate(result.stars.length);
        const words = useStudio.getState().compiled?.words ?? [];
        useMat.getState().scene?.celebrate(danceOf(words, "leader"), danceOf(words, "followers"));
      }),
      useSettings.subscribe(mute),
      useStudio.subscribe(mute),
      useMat.subscribe(mute),
      () => sound.close(),
    );
  }, []);
}

function Notice() {
  const t = useTexts();
  const link = useMat((now) => now.link);
  const problem = useMat((now) => now.problem);
  const isLost = link === "lost" || link === "elsewhere";
  const hasCars = useMat(({ hello }) => Boolean(hello?.cars));
  const isStarting = useStudio(({ service }) => service === "starting") && !hasCars;
  const waiting = isStarting ? t("server.starting") : isLost ? t(`mat.link.${link}`) : null;
  const mat = useStudio((studio) => studio.mat);
  const beside = useMemo(() => carBeside(mat), [mat]);
  const warning = beside === null ? null : t("mat.carBeside", { car: beside });
  const text = waiting ?? (problem ? inLanguage(problem.sentence) : warning);
  return (
    <div role="status">
      {text && (
        <p className={css.notice}>
          <span>{text}</span>
          {link === "elsewhere" && (
            <ToolButton icon="reset" wide label={t("mat.comeBack")} onPress={() => session.comeBack()} />
          )}
        </p>
      )}
    </div>
  );
}
