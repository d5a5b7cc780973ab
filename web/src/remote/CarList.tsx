import { Icon } from "../ui/icons";
import { link } from "./driving";
import { type Told, useRemote } from "./link";
import { type Key, useTexts } from "./texts";
import css from "./remote.module.css";

/** What a car is called on the page. */
export function useCarName(): (car: string) => string {
  const t = useTexts();
  const listed = useRemote(({ listed }) => listed);
  return (car) => {
    const found = listed.find((each) => each.car === car);
    const leads = found?.leads ?? null;
    if (found?.name) return found.name;
    return leads === null ? t("car") : t(leads ? "leader" : "follower", { car });
  };
}

/** What a car does, in a word or two. */
function inShort({ state, driver, you }: Told): Key {
  if (state === "failsafe") return "stoppedItself";
  return driver !== null && !you.drives && state !== "stopped" ? "otherDrives" : state;
}

interface CarListProps {
  /** The car whose camera is shown. */
  shown: string | null;
  onChoose: (car: string) => void;
}

/** The cars that are driven, all by one stick; one of them shows what it sees. */
export function CarList({ shown, onChoose }: CarListProps) {
  const t = useTexts();
  const nameOf = useCarName();
  const listed = useRemote(({ listed }) => listed);
  const seats = useRemote(({ seats }) => seats);
  const told = useRemote(({ told }) => told);
  const others = listed.filter(({ car }) => !seats.includes(car));
  if (listed.length < 2) return null;
  return (
    <section className={css.cars} aria-label={t("cars")}>
      <ul>
        {seats.map((car) => (
          <li key={car} className={css.chip}>
            <button
              type="button"
              aria-pressed={car === shown}
              aria-label={t("look", { name: nameOf(car) })}
              onClick={() => onChoose(car)}
            >
              {nameOf(car)}
            </button>
            {told[car] && (
              <span className={css.brief} data-state={told[car].state}>
                {t(inShort(told[car]))}
              </span>
            )}
            <button type="button" aria-label={t("leave", { name: nameOf(car) })} onClick={() => link.leave(car)}>
              <Icon name="close" />
            </button>
          </li>
        ))}
      </ul>
      <select
        value=""
        aria-label={t("addCar")}
        onChange={(event) => {
          link.sit(event.target.value);
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
