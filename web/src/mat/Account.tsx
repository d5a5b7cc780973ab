import { useEffect, useState } from "react";
import { useTranslation } from "react-i18next";
import { look, Losses, tell } from "./account";
import type { Session } from "./session";
import { useMat } from "./store";
import { ToolSwitch } from "./ToolButton";

const EVERY_MS = 4000;
const LAST_S = 5;
const KEPT = "motorcade.account";

/** Speaks while the cars drive, and once when they stop; not more often than one can listen to. */
export function Account({ session }: { session: Session }) {
  const { t } = useTranslation();
  const [on, setOn] = useState(() => localStorage.getItem(KEPT) !== "off");
  const [said, setSaid] = useState("");
  const playing = useMat(({ state }) => state?.playing ?? false);

  useEffect(() => {
    if (!on) return;
    const losses = new Losses(LAST_S * 1000);
    const end = useMat.subscribe(({ state }, before) => state && state !== before.state && losses.take(state));
    const speak = () => {
      const { hello, state } = useMat.getState();
      if (session.picture && state) setSaid(tell(look(session.picture, new Set(hello?.leads)), losses.take(state), LAST_S));
    };
    const first = setTimeout(speak, 800);
    const timer = playing ? setInterval(speak, EVERY_MS) : undefined;
    return () => {
      end();
      clearTimeout(first);
      clearInterval(timer);
    };
  }, [on, playing, session]);

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
}
