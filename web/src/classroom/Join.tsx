/** How a pupil comes into the class: the code, a nickname with a car, and the number for coming back. */

import { type ReactNode, useEffect, useState } from "react";
import type { ClassAbout, Self } from "../generated/classroom";
import { RefusedError } from "../api/service";
import { useTexts } from "../i18n";
import { Action, Field, Form, Page, Problem } from "../ui/page";
import { titleOr, useAttempt } from "./attempt";
import { askClass, askToJoin } from "./ask";
import { Avatar } from "./Avatar";
import css from "./class.module.css";
import { secretInAddress } from "./secret";

/** Into the studio, with the shared link that led here, if one did. */
const enterStudio = () => location.assign(`/${location.hash}`);

/** Who one is, and the way into the studio. */
function Card({ me, title, children }: { me: Self; title: "welcomeBack" | "hello"; children: ReactNode }) {
  const t = useTexts("class");
  return (
    <section className={css.card} aria-live="polite">
      <div className="row loose">
        <Avatar name={me.avatar} />
        <h2>{t(title, { name: me.name })}</h2>
      </div>
      {children}
    </section>
  );
}

function TheCode({ code, onCode, problem, onCheck }: { code: string; onCode: (code: string) => void; problem: string; onCheck: () => void }) {
  const t = useTexts("class");
  return (
    <Form onSubmit={onCheck}>
      <Field label={t("code")} hint={t("codeHint")} value={code} onChange={onCode} most={20} />
      <Problem text={problem} />
      <Action type="submit" primary disabled={!code.trim()}>
        {t("next")}
      </Action>
    </Form>
  );
}

function Newcomer({ avatars, join }: { avatars: readonly string[]; join: (name: string, avatar: string) => Promise<void> }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [name, setName] = useState("");
  const [avatar, setAvatar] = useState(() => avatars[Math.floor(Math.random() * avatars.length)] ?? "");
  return (
    <Form onSubmit={() => void attempt(() => join(name, avatar))}>
      <Field label={t("nickname")} hint={t("nicknameHint")} value={name} onChange={setName} most={20} />
      <fieldset className={css.avatars}>
        <legend>{t("yourCar")}</legend>
        {avatars.map((each, place) => (
          <label key={each} className={css.avatarChoice}>
            <input
              type="radio"
              name="avatar"
              aria-label={t("carNumber", { number: place + 1 })}
              checked={each === avatar}
              onChange={() => setAvatar(each)}
            />
            <Avatar name={each} />
          </label>
        ))}
      </fieldset>
      <Problem text={problem} />
      <Action type="submit" primary disabled={!name.trim()}>
        {t("comeIn")}
      </Action>
    </Form>
  );
}

function ComeBack({ comeBack }: { comeBack: (name: string, number: string) => Promise<void> }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [name, setName] = useState("");
  const [number, setNumber] = useState("");
  return (
    <Form onSubmit={() => void attempt(() => comeBack(name, number))}>
      <Field label={t("nickname")} value={name} onChange={setName} most={20} />
      <Field label={t("number")} hint={t("numberHint")} value={number} onChange={setNumber} most={4} numeric />
      <Problem text={problem} />
      <Action type="submit" primary disabled={!name.trim() || number.trim().length !== 4}>
        {t("comeIn")}
      </Action>
    </Form>
  );
}

export function Join() {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [about, setAbout] = useState<ClassAbout | null>(null);
  const [code, setCode] = useState(secretInAddress);
  const [checked, setChecked] = useState(false);
  const [returns, setReturns] = useState(false);
  const [me, setMe] = useState<Self | null>(null);
  const check = async () => {
    await askToJoin("check-code", { code });
    setChecked(true);
  };
  useEffect(() => {
    void attempt(async () => {
      setAbout(await askToJoin("about"));
      if (code) await check();
    });
    // Once.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, []);
  const leave = () =>
    attempt(async () => {
      await askClass("leave");
      setAbout(await askClass("about"));
    });

  // The teacher may have changed the code since it was checked: then it is asked for again.
  const withCode = async (task: () => Promise<Self>) => {
    try {
      const self = await task();
      if (self.number) setMe(self);
      else enterStudio();
    } catch (problem) {
      if (!(problem instanceof RefusedError && problem.code === "wrong-class-code")) throw problem;
      setChecked(false);
      await attempt(() => Promise.reject(problem));
    }
  };

  const body = () => {
    const goOn = <Action primary onClick={enterStudio}>{t("goOn")}</Action>;
    if (me) {
      // The personal number, once, before the studio.
      return (
        <Card me={me} title="hello">
          <p>{t("yourNumber")}</p>
          <p className="digits">{me.number}</p>
          {goOn}
        </Card>
      );
    }
    if (about?.me) {
      return (
        <Card me={about.me} title="welcomeBack">
          {goOn}
          <Action onClick={() => void leave()}>{t("notMe")}</Action>
        </Card>
      );
    }
    if (!about) return null;
    if (!checked) return <TheCode code={code} onCode={setCode} problem={problem} onCheck={() => void attempt(check)} />;
    return (
      <>
        {returns ? (
          <ComeBack comeBack={(name, number) => withCode(() => askToJoin("return", { code, name, number }))} />
        ) : (
          <Newcomer avatars={about.avatars} join={(name, avatar) => withCode(() => askToJoin("join", { code, name, avatar }))} />
        )}
        <Action onClick={() => setReturns(!returns)}>{t(returns ? "iAmNew" : "iWasHere")}</Action>
      </>
    );
  };
  return (
    <Page title={titleOr(about?.title, t("joinTitle"))} className={css.narrow}>
      {about && !about.is_open && !about.me && <p className="caution">{t("closed")}</p>}
      <Problem text={about && !about.me && !checked ? "" : problem} />
      {body()}
      <p>
        <a href="/privacy">{t("privacyTitle")}</a>
      </p>
    </Page>
  );
}
