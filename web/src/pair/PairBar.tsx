/** Whose the two windows are, and how they change hands. */

import { EDITORS } from "../api/types";
import { askClass } from "../classroom/ask";
import { useTexts } from "../i18n";
import { attempt } from "../projects/actions";
import areas from "../ui/areas.module.css";
import { Icon } from "../ui/icons";
import { leave } from "./follow";
import css from "./pair.module.css";
import { usePair } from "./store";
import { TextButton } from "../ui/controls";

const TAKE = { leader: "pair.take", followers: "pair.takeFollowers" } as const;

export function PairBar() {
  const t = useTexts();
  const { view, me } = usePair();
  if (!view) return null;
  const act = (task: () => Promise<unknown>) => () => void attempt(task);
  const name = view.partner?.name ?? "";
  if (!view.joined) {
    return (
      <section className={areas.banner} aria-label={t("pair.title")}>
        <span role="status">{t("pair.asked", { name, project: view.name })}</span>
        <TextButton small primary onPress={act(() => askClass("pair/join"))}>{t("pair.come")}</TextButton>
        <TextButton small onPress={act(() => askClass("pair/leave"))}>{t("pair.decline")}</TextButton>
      </section>
    );
  }
  const { owners, asks, partner_away: away, partner_joined: joined } = view;
  const isMine = (window: (typeof EDITORS)[number]) => owners[window] === me;
  const whose = (owner: string | null) => (owner === null ? t("pair.free") : owner === me ? t("pair.you") : name);
  const isOnlooker = EDITORS.every((window) => owners[window] && !isMine(window));
  const news = view.partner && !joined ? "pair.invited" : away ? "pair.away" : isOnlooker ? "pair.onlooker" : null;
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
        <TextButton key={window} small onPress={act(() => askClass("pair/take", { window, wants: true }))}>{t(TAKE[window])}</TextButton>
      ))}
      {canSwap &&
        (asks === null || asks === me ? (
          <TextButton small aria-pressed={asks === me} onPress={act(() => askClass("pair/swap", { wants: asks === null }))}>
            {t(asks === me ? "pair.swapAsked" : "pair.swap")}
          </TextButton>
        ) : (
          <>
            <b role="status">{t("pair.swapWanted", { name })}</b>
            <TextButton small primary onPress={act(() => askClass("pair/swap", { wants: true }))}>{t("pair.agree")}</TextButton>
            <TextButton small onPress={act(() => askClass("pair/swap", { wants: false }))}>{t("pair.keep")}</TextButton>
          </>
        ))}
      <span role="status" className="said">
        {news && t(news, { name })}
      </span>
      <TextButton small onPress={() => void leave()}>{t("pair.leave")}</TextButton>
    </section>
  );
}
