/** The settings of the class, all work as one file, and its end. */

import { useState } from "react";
import type { ClassView } from "../generated/classroom";
import { useTexts } from "../i18n";
import buttons from "../ui/buttons.module.css";
import { Action, Field, Form, Problem, Tick } from "../ui/page";
import { useAttempt } from "./attempt";
import { confirm } from "../state/questions";
import { askTeacher } from "./ask";
import { HowToJoin } from "./HowToJoin";

function Settings({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [title, setTitle] = useState(view.title);
  const [stuckMinutes, setStuckMinutes] = useState(String(view.stuck_minutes));
  const set = (settings: Parameters<typeof askTeacher<"settings">>[1]) => void attempt(() => askTeacher("settings", settings));
  return (
    <section aria-label={t("classSettings")}>
      <h2>{t("classSettings")}</h2>
      <Form onSubmit={() => set({ title })}>
        <Field label={t("classTitle")} value={title} onChange={setTitle} />
        <Action type="submit" disabled={title === view.title}>
          {t("keep")}
        </Action>
      </Form>
      <Tick checked={view.is_open} onChange={(is_open) => set({ is_open })}>
        {t("isOpen")}
      </Tick>
      <label className="row">
        {t("stuckAfter")}
        <input
          type="number"
          min={1}
          max={60}
          value={stuckMinutes}
          onChange={({ target }) => {
            // What is being typed stays, also while it is no number yet.
            setStuckMinutes(target.value);
            if (target.validity.valid && target.value) set({ stuck_minutes: target.valueAsNumber });
          }}
        />
      </label>
      <Problem text={problem} />
    </section>
  );
}

function TheEnd() {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [password, setPassword] = useState("");
  const [ended, setEnded] = useState(false);
  const end = async () => {
    const agreed = await confirm({ title: t("endTitle"), text: t("endAsk"), yes: t("endTitle") });
    if (agreed) setEnded(await attempt(() => askTeacher("end", { password })));
  };
  if (ended) return <p role="status">{t("classEnded")}</p>;
  return (
    <section aria-label={t("endTitle")}>
      <h2>{t("endTitle")}</h2>
      <p>{t("endAbout")}</p>
      <Form onSubmit={() => void end()}>
        <Field label={t("password")} type="password" value={password} onChange={setPassword} most={200} autoComplete="current-password" />
        <Problem text={problem} />
        <Action type="submit" danger disabled={!password}>
          {t("endTitle")}
        </Action>
      </Form>
    </section>
  );
}

export function ClassPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  return (
    <>
      <HowToJoin view={view} canChange />
      <section aria-label={t("collectTitle")}>
        <h2>{t("collectTitle")}</h2>
        <p>{t("collectAbout")}</p>
        <a className={buttons.button} href="/api/teacher/work.zip" download>
          {t("collect")}
        </a>
      </section>
      <Settings view={view} />
      <TheEnd />
      <p>
        <a href="/privacy">{t("privacyTitle")}</a>
      </p>
    </>
  );
}
