/** How pupils find the class, its settings, all work as one file, and its end. */

import { useEffect, useState } from "react";
import type { ClassAddresses, ClassView } from "../generated/classroom";
import { inLanguage, useTexts } from "../i18n";
import buttons from "../ui/buttons.module.css";
import { Action, Field, Form, Problem, Tick } from "../ui/page";
import { useAttempt } from "./attempt";
import { confirm } from "../state/questions";
import { askTeacher } from "./ask";
import css from "./class.module.css";

/** How pupils find the class, where the QR code leads to; `canChange`: the teacher may choose that address, and a new code. */
export function HowToJoin({ view, canChange = false }: { view: ClassView; canChange?: boolean }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [found, setFound] = useState<ClassAddresses | null>(null);
  useEffect(() => {
    void attempt(async () => setFound(await askTeacher("addresses")));
    // Another code gives another QR code.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [view.code]);
  const renew = async () => {
    const agreed = await confirm({ title: t("newCode"), text: t("newCodeAsk"), yes: t("newCode") });
    if (agreed) await attempt(async () => setFound(await askTeacher("new-code")));
  };
  const choose = (address: string) => void attempt(async () => setFound(await askTeacher("choose-address", { address })));
  const choosable = canChange && (found?.addresses.length ?? 0) > 1;
  return (
    <section className={css.addresses} aria-label={t("howToJoin")}>
      <h2>{t("howToJoin")}</h2>
      <Problem text={problem} />
      {found && (
        <>
          <img className={css.qrCode} src={`data:image/svg+xml,${encodeURIComponent(found.qr_code)}`} alt={t("qrCode")} />
          <div>
            <p className="digits">{found.code}</p>
            <ul>
              {found.local_name && <li className={css.address}>{found.local_name}</li>}
              {found.addresses.map((address, place) => (
                <li key={address} className={css.address}>
                  {choosable ? (
                    <Tick group="address" checked={place === 0} onChange={() => choose(address)}>
                      {address}
                    </Tick>
                  ) : (
                    address
                  )}
                </li>
              ))}
            </ul>
            {choosable && <p className="quiet small">{t("chooseAddress")}</p>}
            {canChange && found.addresses.some((address) => !address.startsWith("https:")) && <p className="quiet small">{t("plainHttp")}</p>}
            {canChange && found.why_no_name && <p className="quiet small">{inLanguage(found.why_no_name)}</p>}
            {canChange && <Action onClick={() => void renew()}>{t("newCode")}</Action>}
          </div>
        </>
      )}
    </section>
  );
}

function Settings({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [title, setTitle] = useState(view.title);
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
          value={view.stuck_minutes}
          onChange={(event) => event.target.validity.valid && event.target.value && set({ stuck_minutes: event.target.valueAsNumber })}
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
