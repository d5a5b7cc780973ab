import { useEffect, useState } from "react";
import type { ClassAddresses, ClassView } from "../generated/classroom";
import { inLanguage, useTexts } from "../i18n";
import { confirm } from "../state/questions";
import { Action, Problem, Tick } from "../ui/page";
import { askTeacher } from "./ask";
import { useAttempt } from "./attempt";
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
      <h2 className="across">{t("howToJoin")}</h2>
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
