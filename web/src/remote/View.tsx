import { useEffect, useState } from "react";
import { address } from "./driving";
import { useRemote } from "./link";
import { useTexts } from "./texts";
import css from "./remote.module.css";

const AGAIN_MS = 2000;

/** Whether somebody can see the page. */
function useVisible(): boolean {
  const [visible, setVisible] = useState(!document.hidden);
  useEffect(() => {
    const look = () => setVisible(!document.hidden);
    document.addEventListener("visibilitychange", look);
    return () => document.removeEventListener("visibilitychange", look);
  }, []);
  return visible;
}

/** What a car's camera sees, as long as somebody looks. */
export function View({ car, name }: { car: string; name: string }) {
  const t = useTexts();
  const open = useRemote(({ open }) => open);
  const sees = useRemote(({ listed }) => listed.find((each) => each.car === car)?.sees ?? false);
  const visible = useVisible();
  const [tries, setTries] = useState(0);
  const source = `${address("/camera", car)}#${tries}`;
  if (!sees) return <p className={css.empty}>{t("noCamera", { name })}</p>;
  return (
    <div className={css.view}>
      {open && visible && (
        <img
          key={source}
          src={source}
          alt={t("camera", { name })}
          onError={() => setTimeout(() => setTries((count) => count + 1), AGAIN_MS)}
        />
      )}
    </div>
  );
}
