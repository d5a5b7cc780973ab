import { memo, useEffect, useState } from "react";
import { useTranslation } from "react-i18next";
import { look, Losses, Pace, tell } from "./account";
import type { Session } from "./session";
import { useMat } from "./store";
import { ToolSwitch } from "./ToolButton";

const LOOK_MS = 200;
const LEAST_MS = 3000;
const LAST_S = 5;
const KEPT = "motorcade.account";

/** Speaks when what the cars do changes; not more often than one can listen to. */
export const Account = memo(function Account({ session }: { session: Session }) {
  const { t, i18n } = useTranslation();
  const [on, setOn] = useState(() => localStorage.getItem(KEPT) !== "off");
  const [said, setSaid] = useState("");

  useEffect(() => {
    if (!on) return;
    const losses = new Losses(LAST_S * 1000);
    const pace = new Pace(LEAST_MS);
    let lost = 0;
    const end = useMat.subscribe(({ state }, before) => {
      if (state && state !== before.state) lost = losses.take(state);
    });
    const timer = setInterval(() => {
      if (!session.picture) return;
      const sight = look(session.picture, new Set(useMat.getState().hello?.leads));
      const what = JSON.stringify([sight, lost > 0]);
      if (pace.due(what, performance.now())) setSaid(tell(sight, lost, LAST_S));
    }, LOOK_MS);
    return () => {
      end();
      clearInterval(timer);
    };
  }, [on, session, i18n.language]);

  return (
    <div className="mat-account">
      <ToolSwitch
        label={t("mat.account.title")}
        isSelected={on}
        onChange={(wished) => {
          setOn(wished);
          localStorage.setItem(KEPT, wished ? "on" : "off");
        }}
      />
      <p aria-live="polite">{on ? said : ""}</p>
    </div>
  );
});
