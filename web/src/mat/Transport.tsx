import { memo } from "react";
import { Button } from "react-aria-components";
import { useTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { isHeard, showAlone, toggleSound, useStudio, useWords } from "../state/studio";
import { tellWrongBlock } from "../blocks/fixes";
import { clock } from "../timeline/events";
import { classes } from "../ui/classes";
import { valueOf } from "../words/values";
import { Icon } from "../ui/icons";
import { Choice, ToolButton } from "../ui/fields";
import { session } from "./session";
import { useMat } from "./store";
import css from "./mat.module.css";
import buttons from "../ui/buttons.module.css";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];
const FRACTIONS: Record<string, string> = { 0.25: "¼", 0.5: "½" };

/** Everything that lets the cars drive: play, again, speed, time, and the words to say where a car listens. */
export const Transport = memo(function Transport() {
  const t = useTexts();
  const words = useWords();
  const playing = useMat(({ state }) => state?.playing ?? false);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const empty = cars === 0;
  const waits = useWaits();
  const drives = playing ? t("mat.pause") : t("mat.play");
  const alone = useStudio((studio) => studio.alone);
  const listens = words.some((word) => valueOf(word, "voice"));
  return (
    <div className={css.transport} role="group" aria-label={t("mat.transport")}>
      <Button
        id="mat-play"
        className={classes(buttons.button, buttons.tool, buttons.primary)}
        isDisabled={empty}
        onPress={() => (playing ? session.send({ do: "pause" }) : tellWrongBlock() || session.play())}
      >
        <Icon name={playing ? "pause" : "play"} />
        <span>{waits ? t(`mat.waits.${waits}`) : drives}</span>
      </Button>
      <ToolButton icon="reset" label={t("mat.reset")} isDisabled={empty} onPress={() => session.reset()} />
      <Speed />
      <Clock />
      {listens && (
        <span className={classes("row tight", css.voice)}>
          <ToolButton icon="stop" label={t("mat.sayStop")} wide={t("mat.stop")} isDisabled={empty} onPress={() => session.send({ do: "say", word: "stop" })} />
          <ToolButton icon="go" label={t("mat.sayGo")} wide={t("mat.go")} isDisabled={empty} onPress={() => session.send({ do: "say", word: "go" })} />
        </span>
      )}
      <SoundButton />
      <ToolButton
        icon={alone ? "shrink" : "fit"}
        label={alone ? t("mat.shrink") : t("mat.fullScreen")}
        onPress={() => showAlone(alone ? null : "full")}
      />
    </div>
  );
});

/** What Play waits for, as long as there are no cars; null where it is for the user to add some. */
function useWaits(): "python" | "server" | "words" | null {
  const service = useStudio((studio) => studio.service);
  const isCompiled = useStudio(({ compiled }) => compiled !== null);
  const link = useMat((now) => now.link);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  if (cars) return null;
  if (service === "starting" || service === "restarting") return "python";
  if (link !== "open") return "server";
  return isCompiled ? null : "words";
}

/** The time, which changes far more often than the buttons beside it. */
function Clock() {
  const t = useTexts();
  const tMs = useMat((now) => now.tMs);
  const past = useMat((now) => now.past);
  return (
    <output className={css.clock} data-past={past || undefined} aria-label={t("mat.time")}>
      {clock(tMs)}
    </output>
  );
}

function SoundButton() {
  const t = useTexts();
  // Both decide whether the stage is heard.
  useSettings((settings) => settings.sound);
  useStudio(({ alone, loudProjector }) => `${alone} ${loudProjector}`);
  const heard = isHeard();
  return <ToolButton icon={heard ? "go" : "silence"} label={heard ? t("mat.mute") : t("mat.sound")} onPress={toggleSound} />;
}

function Speed() {
  const t = useTexts();
  const speed = useMat((now) => now.speed);
  return (
    <Choice
      label={t("mat.speed")}
      value={String(speed)}
      all={SPEEDS.map(String)}
      name={(each) => `${FRACTIONS[each] ?? each}×`}
      onChange={(each) => session.setSpeed(Number(each))}
    />
  );
}
