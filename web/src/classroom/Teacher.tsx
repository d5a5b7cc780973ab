/** The teacher's view: who is here and who needs help, and what the whole class is given or told. */

import { useEffect, useState } from "react";
import type { TeacherAbout } from "../generated/classroom";
import { inLanguage, useTexts } from "../i18n";
import { askTeacher } from "./ask";
import { ClassPart } from "./TeacherClass";
import { CarsPart, MatPart } from "./TeacherDriving";
import { PupilsPart } from "./TeacherPupils";
import { HandOutPart } from "./TeacherHandOut";
import { ProgressPart } from "./TeacherWork";
import { Icon } from "../ui/icons";
import buttons from "../ui/buttons.module.css";
import { Action, Field, Form, Page, Problem } from "../ui/page";
import { titleOr, useAttempt } from "./attempt";
import css from "./class.module.css";
import { secretInAddress } from "./secret";
import { useClass } from "./useClass";

const SHORTEST_PASSWORD = 8;

function Password({ about, onSignedIn }: { about: TeacherAbout; onSignedIn: () => void }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [password, setPassword] = useState("");
  const isFirst = !about.has_password;
  const submit = async () => {
    const sent = () => (isFirst ? askTeacher("first-password", { key: secretInAddress, password }) : askTeacher("sign-in", { password }));
    if (await attempt(sent)) onSignedIn();
  };
  return (
    <Form onSubmit={() => void submit()}>
      <p>{t(isFirst ? (secretInAddress ? "firstPassword" : "firstPasswordElsewhere") : "passwordNeeded")}</p>
      {(!isFirst || secretInAddress) && (
        <>
          <Field
            label={t("password")}
            hint={isFirst ? t("passwordHint") : undefined}
            type="password"
            value={password}
            onChange={setPassword}
            most={200}
            autoComplete={isFirst ? "new-password" : "current-password"}
          />
          <Problem text={problem} />
          <Action type="submit" primary disabled={isFirst ? password.length < SHORTEST_PASSWORD : !password}>
            {t(isFirst ? "setPassword" : "signIn")}
          </Action>
        </>
      )}
    </Form>
  );
}

const PARTS = { pupils: PupilsPart, progress: ProgressPart, handOut: HandOutPart, cars: CarsPart, mat: MatPart, class: ClassPart };
type Part = keyof typeof PARTS;

function SignedIn({ onSignedOut }: { onSignedOut: () => void }) {
  const t = useTexts("class");
  const { view, open } = useClass();
  const { problem, attempt } = useAttempt();
  const [part, setPart] = useState<Part>("pupils");
  const Shown = PARTS[part];
  const hands = view?.pupils.filter((pupil) => pupil.hand_s !== null).length ?? 0;
  const tools = (
    <>
      {view && <b className={css.code}>{view.code}</b>}
      <Action aria-pressed={view?.frozen ?? false} disabled={!view} onClick={() => void attempt(() => askTeacher("freeze", { frozen: !view!.frozen }))}>
        {t(view?.frozen ? "thaw" : "freeze")}
      </Action>
      <a className={buttons.button} href="/wall" target="wall">
        {t("wallTitle")}
      </a>
      <Action onClick={() => void attempt(() => askTeacher("sign-out")).then((done) => done && onSignedOut())}>{t("signOut")}</Action>
    </>
  );
  return (
    <Page title={titleOr(view?.title, t("teacherTitle"))} tools={tools} className={css.wide}>
      {!open && view && <p className="caution">{t("linkLost")}</p>}
      <Problem text={problem} />
      {view?.disk && <Problem text={inLanguage(view.disk)} />}
      <nav className={css.parts} aria-label={t("teacherTitle")}>
        {(Object.keys(PARTS) as Part[]).map((each) => (
          <button key={each} type="button" className={css.part} aria-current={each === part ? "page" : undefined} onClick={() => setPart(each)}>
            {t(each)}
            {each === "pupils" && hands > 0 && <span className={css.badge}><Icon name="hand" /> {hands}</span>}
          </button>
        ))}
      </nav>
      {view && <Shown view={view} />}
    </Page>
  );
}

export function Teacher() {
  const t = useTexts("class");
  const [about, setAbout] = useState<TeacherAbout | null>(null);
  const { problem, attempt } = useAttempt();
  useEffect(() => {
    void attempt(async () => setAbout(await askTeacher("about")));
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, []);
  if (about?.signed_in) return <SignedIn onSignedOut={() => setAbout({ has_password: true, signed_in: false })} />;
  return (
    <Page title={t("teacherTitle")} className={css.narrow}>
      <Problem text={problem} />
      {about && <Password about={about} onSignedIn={() => setAbout({ has_password: true, signed_in: true })} />}
    </Page>
  );
}
