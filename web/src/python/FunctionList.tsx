import { useTexts } from "../i18n";
import { CALLS, meaningOf, rangeOf } from "./completion";
import css from "./python.module.css";

const WIDE = "(min-width: 701px)";

/** The functions that a program is made of: what each takes and does, and an example. */
export default function FunctionList() {
  const t = useTexts();
  return (
    <details className={css.functions} open={matchMedia(WIDE).matches}>
      <summary>{t("python.functions")}</summary>
      <dl>
        {CALLS.map((call) => (
          <div key={call.name}>
            <dt>{call.signature}</dt>
            <dd>
              {meaningOf(call)}
              {call.parameters.map((each) => (
                <p key={each.name} className="quiet small">
                  <code>{each.name}</code> {rangeOf(each)}
                </p>
              ))}
              <code>{call.example}</code>
            </dd>
          </div>
        ))}
      </dl>
    </details>
  );
}
