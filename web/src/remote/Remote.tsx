import { useEffect, useState } from "react";
import { Bar } from "./Bar";
import { CarList, useCarName } from "./CarList";
import { Controls, Stop } from "./Controls";
import { begin } from "./driving";
import { Notices } from "./Notices";
import { useLanguage, useTexts } from "./texts";
import { Stick } from "./Stick";
import { useRemote } from "./link";
import { View } from "./View";
import css from "./remote.module.css";

let begun = false;

/** The whole page: what the cars see, who drives them, and the stick. */
export function Remote() {
  const t = useTexts();
  const language = useLanguage(({ language }) => language);
  const seats = useRemote(({ seats }) => seats);
  const [chosen, choose] = useState<string | null>(null);
  const nameOf = useCarName();
  useEffect(() => {
    if (!begun) begin();
    begun = true;
  }, []);
  useEffect(() => {
    document.title = `${t("title")} · Motorcade`;
  }, [language, t]);
  const shown = chosen !== null && seats.includes(chosen) ? chosen : (seats[0] ?? null);
  return (
    <div className={css.remote}>
      <Bar />
      <main>
        <div className={css.seeing}>
          <CarList shown={shown} onChoose={choose} />
          {shown === null ? <p className={css.empty}>{t("noCars")}</p> : <View car={shown} name={nameOf(shown)} />}
        </div>
        <div className={css.driving}>
          <Notices car={shown} />
          <Stick />
          <Stop />
          <Controls car={shown} />
        </div>
      </main>
    </div>
  );
}
