import type { CarTelemetry } from "../generated/remote";
import { inLanguage, type KeyIn, useTexts } from "../i18n";
import { Icon } from "../ui/icons";
import { Action } from "../ui/page";
import { link, useRemote, userOf } from "./link";
import css from "./remote.module.css";

/** What a car tells, with a state more. */
type ShownTelemetry = Omit<CarTelemetry, "state"> & { state: CarTelemetry["state"] | "standing" };

/** The car's name on the page. */
export function useCarName(): (car: string) => string {
  const t = useTexts("remote");
  const cars = useRemote(({ cars }) => cars);
  return (car) => {
    const found = cars.find((each) => each.car === car);
    const leads = found?.leads ?? null;
    if (found?.name) return found.name;
    return leads === null ? t("car") : t(leads ? "leader" : "follower", { car });
  };
}

/** The telemetry to show: a car that stopped by itself before this page's user drove just stands still. */
function useTelemetry(): Record<string, ShownTelemetry> {
  const { hasDriven, telemetry } = useRemote();
  if (hasDriven) return telemetry;
  const shown = Object.entries(telemetry).map(([car, told]) => [car, told.state === "failsafe" ? { ...told, state: "standing" } : told]);
  return Object.fromEntries(shown) as Record<string, ShownTelemetry>;
}

/** What a car does, as the key of a short text. */
function shortText({ state, driver, you, obstacle_mm }: ShownTelemetry): KeyIn<"remote"> {
  if (obstacle_mm != null) return "obstacleAhead";
  if (state === "discharged") return "batteryLow";
  if (state === "disarmed") return "standing";
  if (state === "failsafe") return "stoppedItself";
  return driver !== null && !you.drives && state !== "stopped" ? "otherDrives" : state;
}

/** The cars that are driven, all by one stick; the camera of one of them, `shown`, is shown. */
export function CarList({ shown, onChoose }: { shown: string | null; onChoose: (car: string) => void }) {
  const t = useTexts("remote");
  const nameOf = useCarName();
  const { cars, joined } = useRemote();
  const telemetry = useTelemetry();
  const others = cars.filter(({ car }) => !joined.includes(car));
  // A car's own page has one car, which can be left out by the page's address alone.
  if (cars.length < 2 && joined.length === cars.length) return null;
  return (
    <section className="wrap" aria-label={t("cars")}>
      <ul className="wrap">
        {joined.map((car) => (
          <li key={car} className={css.chip}>
            <button
              type="button"
              className="bare"
              aria-pressed={car === shown}
              aria-label={t("look", { name: nameOf(car) })}
              onClick={() => onChoose(car)}
            >
              {nameOf(car)}
            </button>
            {telemetry[car] && (
              <span className={css.brief} data-state={telemetry[car].state}>
                {t(shortText(telemetry[car]))}
              </span>
            )}
            <button type="button" className="bare" aria-label={t("leave", { name: nameOf(car) })} onClick={() => link.leave(car)}>
              <Icon name="close" />
            </button>
          </li>
        ))}
      </ul>
      <select
        value=""
        aria-label={t("addCar")}
        onChange={(event) => {
          link.join(event.target.value);
          // The next arrow key is meant for the cars.
          event.target.blur();
        }}
      >
        <option value="">{t("addCar")}</option>
        {others.map(({ car }) => (
          <option key={car} value={car}>
            {nameOf(car)}
          </option>
        ))}
      </select>
    </section>
  );
}

const FULL_DUTY = 255;

/** What the car does and who drives it, and below, what is wrong. */
export function Notices({ car }: { car: string | null }) {
  const t = useTexts("remote");
  const { open, opening, problem } = useRemote();
  const shown = useTelemetry();
  const telemetry = car === null ? undefined : shown[car];
  const driver = userOf(telemetry?.driver ?? null);
  const othersDrive = driver === null ? t("othersDrive") : t("driverDrives", { name: driver });
  const others = telemetry?.driver != null && !telemetry.you.drives;
  const speed = telemetry ? Math.round((telemetry.speed / FULL_DUTY) * 100) : 0;
  return (
    <div>
      <p className={css.state} role="status" data-state={telemetry?.state}>
        {telemetry ? t(telemetry.obstacle_mm != null ? "obstacleAhead" : telemetry.state) : " "}
        {telemetry?.state === "moving" && (
          <meter aria-label={t("speed")} min={0} max={100} value={speed}>
            {speed}
          </meter>
        )}
        {telemetry?.battery_mv != null && (
          <span className={css.battery}>{t("battery", { volts: (telemetry.battery_mv / 1000).toFixed(1) })}</span>
        )}
      </p>
      <div role="log">
        {!open && !opening && <p className={css.notice} data-tone="error">{t("lostAbout")}</p>}
        {telemetry?.why && <p className={css.notice} data-tone="error">{inLanguage(telemetry.why)}</p>}
        {telemetry?.paused && (
          <p className={css.notice}>
            {t("paused")}
            <Action onClick={() => link.send({ do: "start" })}>{t("start")}</Action>
          </p>
        )}
        {telemetry?.obstacle_mm != null && (
          <p className={css.notice} data-tone="error">
            {t("obstacle", { distance: Math.round(telemetry.obstacle_mm / 10) })}
          </p>
        )}
        {others && <p className={css.notice}>{telemetry.you.waits ? t("waits") : othersDrive}</p>}
        {telemetry?.you.drives && telemetry.wanted_by !== null && <p className={css.notice}>{t("wanted")}</p>}
        {telemetry?.last_fault && <p className={css.notice} data-tone="error">{t("fault", { fault: telemetry.last_fault })}</p>}
        {problem && (
          <p className={css.notice} data-tone="error">
            {inLanguage(problem)}
            <Action onClick={() => useRemote.setState({ problem: null })}>{t("dismiss")}</Action>
          </p>
        )}
      </div>
    </div>
  );
}
