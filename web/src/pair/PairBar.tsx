/** Whose the two windows are, and how they change hands. */

import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { EDITORS } from "../api/types";
import { attempt } from "../projects/actions";
import areas from "../ui/areas.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";
import { Icon } from "../ui/icons";
import { leave } from "./follow";
import css from "./pair.module.css";
import { type Shared, usePair } from "./store";

const small = classes(buttons.button, buttons.small);
const TAKE = { leader: "pair.take", followers: "pair.takeFollowers" } as const;

export function PairBar() {
  const { t } = useTranslation();
  const { view, me, shared } = usePair();
  if (!view || !shared) return null;
  const act = (task: (shared: Shared) => Promise<unknown>) => () => void attempt(() => task(shared));
  const name = view.partner?.name ?? "";
  if (!view.joined) {
    return (
      <section className={areas.banner} aria-label={t("pair.title")}>
        <span role="status">{t("pair.asked", { name, project: view.name })}</span>
        <Button className={classes(small, buttons.primary)} onPress={act((to) => to.join())}>
          {t("pair.come")}
        </Button>
        <Button className={small} onPress={act((to) => to.leave())}>
          {t("pair.decline")}
        </Button>
      </section>
    );
  }
  const { owners, asks, partner_away: away, partner_joined: joined } = view;
  const isMine = (window: (typeof EDITORS)[number]) => owners[window] === me;
  const whose = (owner: string | null) => (owner === null ? t("pair.free") : owner === me ? t("pair.you") : name);
  const canSwap = joined && !away && EDITORS.every((window) => owners[window]) && !EDITORS.every(isMine) && EDITORS.some(isMine);
  return (
    <section className={areas.banner} aria-label={t("pair.title")}>
      <Icon name="pencil" />
      {EDITORS.map((window) => (
        <span key={window} className={css.window} data-editor={window} data-mine={isMine(window) || undefined}>
          {t(`pair.${window}`, { name: whose(owners[window] ?? null) })}
        </span>
      ))}
      {EDITORS.filter((window) => !owners[window] || (away && !isMine(window))).map((window) => (
        <Button key={window} className={small} onPress={act((to) => to.take(window, true))}>
          {t(TAKE[window])}
        </Button>
      ))}
      {canSwap &&
        (asks === null || asks === me ? (
          <Button className={small} aria-pressed={asks === me} onPress={act((to) => to.swap(asks === null))}>
            {t(asks === me ? "pair.swapAsked" : "pair.swap")}
          </Button>
        ) : (
          <>
            <b role="status">{t("pair.swapWanted", { name })}</b>
            <Button className={classes(small, buttons.primary)} onPress={act((to) => to.swap(true))}>
              {t("pair.agree")}
            </Button>
            <Button className={small} onPress={act((to) => to.swap(false))}>
              {t("pair.keep")}
            </Button>
          </>
        ))}
      <span role="status" className={css.news}>
        {view.partner && !joined ? t("pair.invited", { name }) : away ? t("pair.away", { name }) : ""}
      </span>
      <Button className={small} onPress={() => void leave()}>
        {t("pair.leave")}
      </Button>
    </section>
  );
}
