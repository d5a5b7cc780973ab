/** A pupil's bar below the header: who one is, the raised hand, the cable and the cars; and what covers the page when all look up. */

import { useEffect, useRef, useState } from "react";
import { Button } from "react-aria-components";
import { askClass } from "../classroom/ask";
import { Avatar } from "../classroom/Avatar";
import type { Classmate, PupilView } from "../generated/classroom";
import { useTexts } from "../i18n";
import { saveToLibrary } from "../projects/actions";
import { openProject } from "../projects/project";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import areas from "../ui/areas.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";
import { Sheet, TextButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import { attemptInClass, openHandedMission, usePupil } from "./store";
import css from "./pupil.module.css";

function Hand({ raised }: { raised: boolean }) {
  const t = useTexts();
  return (
    <TextButton small aria-pressed={raised} onPress={() => void attemptInClass(() => askClass("hand", { raised: !raised }))}>
      <Icon name="hand" />
      {t(raised ? "pupil.lowerHand" : "pupil.raiseHand")}
    </TextButton>
  );
}

interface ClassmatesProps {
  title: string;
  about: string;
  canChoose?: boolean;
  onChoose: (to: Classmate) => void;
  onClose: () => void;
}

/** Choose one of the class. */
function Classmates({ title, about, canChoose = true, onChoose, onClose }: ClassmatesProps) {
  const t = useTexts();
  const [classmates, setClassmates] = useState<Classmate[] | null>(null);
  useEffect(() => void attemptInClass(async () => setClassmates(await askClass("classmates"))), []);
  return (
    <Sheet title={title} onClose={onClose}>
      <p>{about}</p>
      {classmates?.length === 0 && <p>{t("pupil.nobodyElse")}</p>}
      <ul className={css.classmates}>
        {canChoose &&
          classmates?.map((each) => (
            <li key={each.id}>
              <TextButton onPress={() => onChoose(each)}>
                <Avatar name={each.avatar} />
                {each.name}
              </TextButton>
            </li>
          ))}
      </ul>
    </Sheet>
  );
}

/** Give the open project to a classmate, once it is saved under its name. */
function Give({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const name = useStudio((studio) => studio.name.trim());
  const give = (to: Classmate) =>
    attemptInClass(async () => {
      if (!(await saveToLibrary())) return;
      await askClass("give", { to: to.id, name });
      notify(t("pupil.given", { name, to: to.name }), "success");
      onClose();
    });
  const about = t(name ? "pupil.giveAbout" : "pupil.giveNeedsName");
  return <Classmates title={t("pupil.giveTitle")} about={about} canChoose={name !== ""} onChoose={(to) => void give(to)} onClose={onClose} />;
}

/** Program the open project with a classmate. */
function Together({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const begin = (to: Classmate) =>
    attemptInClass(async () => {
      const { name, mission } = useStudio.getState();
      await askClass("pair/begin", { to: to.id, name: name.trim() || t("pair.nameless"), project: openProject(), mission });
      onClose();
    });
  return <Classmates title={t("pair.title")} about={t("pair.about")} onChoose={(to) => void begin(to)} onClose={onClose} />;
}

/** The shared mat, while it takes programs. */
function Mat({ view }: { view: PupilView }) {
  const t = useTexts();
  const image = useStudio((studio) => studio.compiled?.image ?? null);
  const { state, entries } = view.mat;
  if (state !== "collecting") return null;
  const isThere = entries.includes(view.me.id);
  const send = (program: string | null) => void attemptInClass(() => askClass("mat", { image: program }));
  return (
    <>
      <TextButton small isDisabled={!image} onPress={() => send(image)}>
        {t(isThere ? "pupil.matAgain" : "pupil.matSend")}
      </TextButton>
      {isThere && (
        <TextButton small onPress={() => send(null)}>{t("pupil.matLeave")}</TextButton>
      )}
    </>
  );
}

/** Where it is free, one's own, and another's. */
const TEXTS_OF_A_CAR = ["pupil.driveCar", "pupil.leaveCar", "pupil.carTaken"] as const;
const TEXTS_OF_THE_CABLE = ["pupil.cable", "pupil.cableYours", "pupil.cableTaken"] as const;

/** The real cars, and the cable where something is at its end, which one pupil at a time has. */
function SharedThings({ view }: { view: PupilView }) {
  const t = useTexts();
  const useful = view.shared.filter(({ name, holder }) => name || view.cabled || holder === view.me.id);
  return useful.map(({ name, holder }) => {
    const isMine = holder === view.me.id;
    const whose = holder === null ? 0 : isMine ? 1 : 2;
    const text = name ? TEXTS_OF_A_CAR[whose] : TEXTS_OF_THE_CABLE[whose];
    return (
      <span key={name} className={classes("row", css.turn)}>
        <TextButton
          small
          isDisabled={holder !== null && !isMine}
          onPress={() => void attemptInClass(() => askClass("take", { name, wants: !isMine }))}
        >
          {t(text, { car: name })}
        </TextButton>
        {isMine && name && (
          <a className={buttons.button} href={`/drive?car=${encodeURIComponent(name)}`} target="drive">
            {t("pupil.yourTurn")}
          </a>
        )}
      </span>
    );
  });
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
  const t = useTexts();
  const { view, goodbye } = usePupil();
  const [shown, show] = useState<"give" | "together" | "number" | null>(null);
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
    <section className={classes(areas.banner, css.bar)} aria-label={t("pupil.title")}>
      <Button className={css.me} aria-label={t("pupil.me", { name: me.name })} onPress={() => show("number")}>
        <Avatar name={me.avatar} />
        <b>{me.name}</b>
      </Button>
      <Hand raised={view.hand} />
      {view.mission !== null && (
        <TextButton small onPress={() => void openHandedMission()}>{t("pupil.openMission")}</TextButton>
      )}
      <Mat view={view} />
      <SharedThings view={view} />
      <TextButton small onPress={() => show("give")}>{t("pupil.give")}</TextButton>
      {!view.pair?.partner && (
        <TextButton small onPress={() => show("together")}>{t("pair.begin")}</TextButton>
      )}
      {view.stopped && <b role="status">{t("pupil.stopped")}</b>}
      {shown === "give" && <Give onClose={() => show(null)} />}
      {shown === "together" && <Together onClose={() => show(null)} />}
      {shown === "number" && (
        <Sheet title={me.name} onClose={() => show(null)}>
          <p>{t("pupil.number")}</p>
          <p className="digits">{me.number}</p>
          <TextButton onPress={leave}>{t("pupil.leave")}</TextButton>
        </Sheet>
      )}
      {view.frozen && <Cover title={t("pupil.frozen")} />}
    </section>
  );
}
