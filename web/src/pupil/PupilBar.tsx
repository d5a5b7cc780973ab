/** A pupil's bar below the header: who one is, the raised hand, the queues; and what covers the page when all look up. */

import { useEffect, useRef, useState } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { askClass } from "../classroom/ask";
import { Avatar } from "../classroom/Avatar";
import type { Classmate, PupilView } from "../generated/classroom";
import { saveToLibrary } from "../projects/actions";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";
import { Sheet } from "../ui/controls";
import { Icon } from "../ui/icons";
import { attemptInClass, openHandedMission, usePupil } from "./store";
import css from "./pupil.module.css";

const small = classes(buttons.button, buttons.small);

function Hand({ raised }: { raised: boolean }) {
  const { t } = useTranslation();
  return (
    <Button
      className={classes(small, css.hand)}
      aria-pressed={raised}
      onPress={() => void attemptInClass(() => askClass("hand", { raised: !raised }))}
    >
      <Icon name="hand" />
      {t(raised ? "pupil.lowerHand" : "pupil.raiseHand")}
    </Button>
  );
}

/** Give the open project to a classmate, once it is saved under its name. */
function Give({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const name = useStudio((studio) => studio.name.trim());
  const [classmates, setClassmates] = useState<Classmate[]>([]);
  useEffect(() => void attemptInClass(async () => setClassmates(await askClass("classmates"))), []);
  const give = (to: Classmate) =>
    attemptInClass(async () => {
      if (!(await saveToLibrary())) return;
      await askClass("give", { to: to.id, name });
      notify(t("pupil.given", { name, to: to.name }), "success");
      onClose();
    });
  return (
    <Sheet title={t("pupil.giveTitle")} onClose={onClose}>
      <p>{t(name ? "pupil.giveAbout" : "pupil.giveNeedsName")}</p>
      <ul className={css.classmates}>
        {name &&
          classmates.map((each) => (
            <li key={each.id}>
              <Button className={buttons.button} onPress={() => void give(each)}>
                <Avatar name={each.avatar} />
                {each.name}
              </Button>
            </li>
          ))}
      </ul>
    </Sheet>
  );
}

/** The shared mat, while it takes programs. */
function Mat({ view }: { view: PupilView }) {
  const { t } = useTranslation();
  const image = useStudio((studio) => studio.compiled?.image ?? null);
  const { state, entries } = view.mat;
  if (state !== "collecting") return null;
  const isThere = entries.includes(view.me.id);
  const send = (program: string | null) => void attemptInClass(() => askClass("mat", { image: program }));
  return (
    <>
      <Button className={small} isDisabled={!image} onPress={() => send(image)}>
        {t(isThere ? "pupil.matAgain" : "pupil.matSend")}
      </Button>
      {isThere && (
        <Button className={small} onPress={() => send(null)}>
          {t("pupil.matLeave")}
        </Button>
      )}
    </>
  );
}

/** The queues for the cable and for the real cars. */
function Queues({ view }: { view: PupilView }) {
  const { t } = useTranslation();
  const { cable, cable_use, turns, me } = view;
  const wish = (wants: boolean) => void attemptInClass(() => askClass("cable", { wants }));
  return (
    <>
      <Button className={small} onPress={() => wish(cable === null)}>
        {cable === null ? t("pupil.cable") : cable === 0 ? t("pupil.cableYours") : t("pupil.cableWait", { count: cable })}
      </Button>
      {cable === 0 && cable_use !== "free" && (
        <span role="status">{t(cable_use === "ending" ? "pupil.cableEnding" : "pupil.cableSends")}</span>
      )}
      {turns.map(({ car, driver, left_s, waiting }) => {
        const place = waiting.indexOf(me.id);
        const isIn = driver === me.id || place >= 0;
        return (
          <span key={car} className={css.turn}>
            <Button className={small} onPress={() => void attemptInClass(() => askClass("turn", { car, wants: !isIn }))}>
              {isIn ? t("pupil.leaveCar", { car }) : t("pupil.driveCar", { car })}
            </Button>
            {driver === me.id && (
              <a href={`/drive?car=${encodeURIComponent(car)}`} target="drive">
                {t("pupil.yourTurn", { count: left_s })}
              </a>
            )}
            {place >= 0 && t("pupil.turnWait", { count: place + 1 })}
          </span>
        );
      })}
    </>
  );
}

/** What covers the whole page; nothing below it can be reached. */
function Cover({ title, children }: { title: string; children?: React.ReactNode }) {
  const dialog = useRef<HTMLDialogElement>(null);
  const show = () => dialog.current?.showModal();
  useEffect(show, []);
  // A browser closes a dialog at the second Escape, whatever the page answers to `cancel`.
  return (
    <dialog ref={dialog} className={css.cover} aria-label={title} onCancel={(event) => event.preventDefault()} onClose={show}>
      <p>{title}</p>
      {children}
    </dialog>
  );
}

export function PupilBar() {
  const { t } = useTranslation();
  const { view, goodbye } = usePupil();
  const [shown, show] = useState<"give" | "number" | null>(null);
  if (goodbye) {
    return (
      <Cover title={t(`pupil.goodbye.${goodbye}`)}>
        <a href="/join">{t("pupil.joinAgain")}</a>
      </Cover>
    );
  }
  if (!view) return null;
  const { me } = view;
  const leave = () =>
    void attemptInClass(async () => {
      await askClass("leave");
      location.assign("/join");
    });
  return (
    <section className={css.bar} aria-label={t("pupil.title")}>
      <Button className={css.me} aria-label={t("pupil.me", { name: me.name })} onPress={() => show("number")}>
        <Avatar name={me.avatar} />
        <b>{me.name}</b>
      </Button>
      <Hand raised={view.hand} />
      {view.mission !== null && (
        <Button className={small} onPress={() => void openHandedMission()}>
          {t("pupil.openMission")}
        </Button>
      )}
      <Mat view={view} />
      <Queues view={view} />
      <Button className={small} onPress={() => show("give")}>
        {t("pupil.give")}
      </Button>
      {view.stopped && <b role="status">{t("pupil.stopped")}</b>}
      {shown === "give" && <Give onClose={() => show(null)} />}
      {shown === "number" && (
        <Sheet title={me.name} onClose={() => show(null)}>
          <p>{t("pupil.number")}</p>
          <p className={css.number}>{me.number}</p>
          <Button className={buttons.button} onPress={leave}>
            {t("pupil.leave")}
          </Button>
        </Sheet>
      )}
      {view.frozen && <Cover title={t("pupil.frozen")} />}
    </section>
  );
}
