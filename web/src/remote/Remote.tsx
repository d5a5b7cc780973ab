import { useEffect, useState, useSyncExternalStore } from "react";
import { useTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { listen } from "../ui/areas";
import { Action, Form, Page } from "../ui/page";
import { CarList, Notices, useCarName } from "./Cars";
import { Controls, Stick, Stop } from "./Controls";
import { address, link, useRemote } from "./link";
import css from "./remote.module.css";
import { classes } from "../ui/classes";

/** A car that receives nothing for longer has stopped by itself. */
const WEAK_MS = 300;
const LOOK_EVERY_MS = 250;

/** For how long the server has sent nothing, updated from time to time. */
function useSilenceMs(): number {
  const [silenceMs, setSilenceMs] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => {
      setSilenceMs(performance.now() - useRemote.getState().receivedAtMs);
    }, LOOK_EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  return silenceMs;
}

function LinkState() {
  const t = useTexts("remote");
  const { open, opening, roundTripMs, telemetry } = useRemote();
  // A car that is away is shown as such.
  const silences = Object.values(telemetry).map((car) => (car.state === "away" ? 0 : car.silent_ms));
  const silenceMs = Math.max(useSilenceMs(), ...silences);
  const worst = Math.round(Math.max(roundTripMs ?? 0, silenceMs > WEAK_MS ? silenceMs : 0));
  const kind = opening ? "opening" : !open ? "lost" : worst > WEAK_MS ? "weak" : "good";
  const texts = {
    opening: t("linkOpening"),
    lost: t("linkLost"),
    weak: t("linkWeak", { ms: worst }),
    good: roundTripMs === null ? t("linkIdle") : t("linkGood", { ms: Math.round(roundTripMs) }),
  };
  const tones = { opening: undefined, lost: "error", weak: "warning", good: undefined };
  const text = texts[kind];
  return (
    <p className={classes("row figures", css.linkState)} data-tone={tones[kind]} aria-label={`${t("link")}: ${text}`} role="img">
      <span className="dot" />
      {text}
    </p>
  );
}

/** As many as the server takes. */
const MOST_OF_A_NAME = 24;

/** A field for the user's name, which others see and the log has. */
function NameField() {
  const t = useTexts("remote");
  const [text, setText] = useState(useSettings.getState().userName ?? "");
  const keep = (userName: string) => {
    useSettings.setState({ userName });
    link.reconnect();
  };
  return (
    <Form className={classes("wrap", css.nameField)} onSubmit={() => keep(text.trim())}>
      <label className="wrap">
        {t("yourName")}
        <input value={text} maxLength={MOST_OF_A_NAME} autoComplete="nickname" onChange={(event) => setText(event.target.value)} />
      </label>
      <Action type="submit" disabled={!text.trim()}>
        {t("keepName")}
      </Action>
      <Action onClick={() => keep("")}>{t("noName")}</Action>
    </Form>
  );
}

/** Ask for the user's name, once. */
function AskName() {
  const asks = useSettings(({ userName }) => userName === null);
  return asks && <NameField />;
}

const AGAIN_MS = 2000;

/** Whether the page is visible. */
const useVisible = (): boolean => useSyncExternalStore(watchVisibility, () => !document.hidden);
const watchVisibility = (changed: () => void) => listen(document, ["visibilitychange"], changed);

/** The picture of a car's camera, loaded only while the page is visible. */
function View({ car, name }: { car: string; name: string }) {
  const t = useTexts("remote");
  const open = useRemote(({ open }) => open);
  const sees = useRemote(({ cars }) => cars.find((each) => each.car === car)?.sees ?? false);
  const visible = useVisible();
  const [tries, setTries] = useState(0);
  const source = `${address("/camera", car)}#${tries}`;
  if (!sees) return <p className={css.empty}>{t("noCamera", { name })}</p>;
  return (
    <div className={css.view}>
      {open && visible && (
        <img
          key={source}
          className="whole"
          src={source}
          alt={t("camera", { name })}
          onError={() => setTimeout(() => setTries((count) => count + 1), AGAIN_MS)}
        />
      )}
    </div>
  );
}

/** The whole page: the cameras, the cars and their drivers, and the stick. */
export function Remote() {
  const t = useTexts("remote");
  const joined = useRemote(({ joined }) => joined);
  const isEmpty = useRemote(({ cars }) => cars.length === 0);
  const [chosen, choose] = useState<string | null>(null);
  const nameOf = useCarName();
  const hasAsked = useSettings(({ userName }) => userName !== null);
  const shown = chosen !== null && joined.includes(chosen) ? chosen : (joined[0] ?? null);
  return (
    <Page title={t("title")} className={css.remote} tools={<LinkState />} settings={hasAsked && <NameField />}>
      <div className={css.parts}>
        <div className={css.seeing}>
          <CarList shown={shown} onChoose={choose} />
          {shown === null ? <p className={css.empty}>{t(isEmpty ? "noCars" : "noneChosen")}</p> : <View car={shown} name={nameOf(shown)} />}
        </div>
        <div className={classes("column fill", css.driving)}>
          <AskName />
          <Notices car={shown} />
          <Stick />
          <Controls car={shown} />
        </div>
      </div>
      <Stop />
    </Page>
  );
}
