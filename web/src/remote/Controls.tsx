import { type KeyboardEvent, type PointerEvent, useRef, useState } from "react";
import { SWITCHES } from "../generated/driving";
import { type KeyIn, useTexts } from "../i18n";
import { classes } from "../ui/classes";
import { Icon } from "../ui/icons";
import { Action } from "../ui/page";
import { fingerAxes } from "./input";
import { AT_REST, type Axes, FIRST_LIMIT, inputs, link, stopAll, useRemote } from "./link";
import css from "./remote.module.css";

/** How far the knob can go, as a share of the pad's half. */
const REACH = 0.72;

/** A pad on which a finger steers; the knob springs back on release. */
export function Stick() {
  const t = useTexts("remote");
  const pad = useRef<HTMLDivElement>(null);
  const [axes, setAxes] = useState<Axes | null>(null);

  function follow(event: PointerEvent): void {
    const box = pad.current!.getBoundingClientRect();
    const reach = (box.width / 2) * REACH;
    const now = fingerAxes(
      (event.clientX - box.left - box.width / 2) / reach,
      (event.clientY - box.top - box.height / 2) / reach,
    );
    setAxes(now);
    inputs.hold("stick", now);
  }

  function release(): void {
    setAxes(null);
    inputs.release("stick");
  }

  const { throttle, steering } = axes ?? AT_REST;
  return (
    <div className={css.stick}>
      <div
        ref={pad}
        className={css.pad}
        data-held={axes !== null || undefined}
        role="application"
        aria-label={t("stick")}
        aria-describedby="stick-about"
        tabIndex={0}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          follow(event);
        }}
        onPointerMove={(event) => axes && follow(event)}
        onPointerUp={release}
        onPointerCancel={release}
        onLostPointerCapture={release}
        onContextMenu={(event) => event.preventDefault()}
      >
        <span className={css.cross} />
        <span
          className={css.knob}
          style={{ left: `${50 + steering * REACH * 50}%`, top: `${50 - throttle * REACH * 50}%` }}
        />
      </div>
      <p id="stick-about" className={css.about}>
        {t("stickAbout")}
      </p>
    </div>
  );
}

const LEAST_PERCENT = 20;
const STEP_PERCENT = 10;

function Limit() {
  const t = useTexts("remote");
  const [percent, setPercent] = useState(FIRST_LIMIT * 100);
  return (
    <label className={classes("stack tight", css.limit)}>
      {t("limit", { percent })}
      <input
        type="range"
        min={LEAST_PERCENT}
        max={100}
        step={STEP_PERCENT}
        value={percent}
        onChange={(event) => {
          setPercent(Number(event.target.value));
          inputs.limit = Number(event.target.value) / 100;
        }}
      />
    </label>
  );
}

/** The emergency stop of all cars: below what can be scrolled, so it stays in sight and covers nothing. */
export function Stop() {
  const t = useTexts("remote");
  return (
    <button type="button" className={css.stop} onClick={stopAll}>
      {t("stop")}
      <kbd>{t("stopAbout")}</kbd>
    </button>
  );
}

/** A button for each switch that the car has: one that is held is on while it is pressed. */
function Switches({ car }: { car: string }) {
  const t = useTexts("remote");
  const switches = useRemote(({ telemetry }) => telemetry[car]?.switches);
  return SWITCHES.filter(({ name }) => switches?.[name] !== undefined).map(({ name, held, key }) => {
    const isOn = switches![name] === 1;
    const events = held
      ? {
          onPointerDown: () => inputs.press(name),
          onPointerUp: () => inputs.lift(name),
          onPointerLeave: () => inputs.lift(name),
          onPointerCancel: () => inputs.lift(name),
          onKeyDown: ({ key, repeat }: KeyboardEvent) => key === "Enter" && !repeat && inputs.press(name),
          onKeyUp: ({ key }: KeyboardEvent) => key === "Enter" && inputs.lift(name),
          onBlur: () => inputs.lift(name),
        }
      : { onClick: () => inputs.set(name, isOn ? 0 : 1) };
    return (
      <Action key={name} aria-pressed={isOn} {...events}>
        {t(`switch_${name}` as KeyIn<"remote">)} <kbd>{key.toUpperCase()}</kbd>
      </Action>
    );
  });
}

const ASKS = ["clear", "request", "release", "resume"] as const;

/** The requests to a car, what can be switched, and the limit of the speed. */
export function Controls({ car }: { car: string | null }) {
  const t = useTexts("remote");
  const telemetry = useRemote(({ telemetry }) => (car === null ? undefined : telemetry[car]));
  const { state, driver, you } = telemetry ?? {};
  /** What can be asked of the car now. */
  const asks = {
    clear: state === "stopped",
    request: you && !you.drives && driver !== null && !you.waits,
    release: you && (you.drives || you.waits),
    resume: state && !["stopped", "program", "away", "discharged"].includes(state),
  };
  return (
    <div className="column">
      {car !== null && (
        <div className="wrap">
          {ASKS.filter((what) => asks[what]).map((what) => (
            <Action key={what} primary={what === "clear"} onClick={() => link.send({ do: what, car })}>
              {what === "resume" && <Icon name="blocks" />}
              {t(what)}
            </Action>
          ))}
          <Switches car={car} />
        </div>
      )}
      <Limit />
    </div>
  );
}
