/** The list of pupils: who is here, who needs help, and what each one does. */

import { useState } from "react";
import type { ClassView, PupilRow, PupilLibrary } from "../generated/classroom";
import { useLanguage, useTexts } from "../i18n";
import { confirm } from "../state/questions";
import { askTeacher } from "./ask";
import { Avatar } from "./Avatar";
import { HowToJoin } from "./HowToJoin";
import { Icon } from "../ui/icons";
import { Action, Form, Problem } from "../ui/page";
import { useAttempt } from "./attempt";
import css from "./class.module.css";
import { classes } from "../ui/classes";

/** Raised hands first, by who waits longest; then those who are stuck; then the others in their order. */
export function byNeed(pupils: readonly PupilRow[]): PupilRow[] {
  const rank = ({ online, hand_s, stuck_s }: PupilRow) => (hand_s !== null ? 0 : !online ? 3 : stuck_s !== null ? 1 : 2);
  const waits = ({ hand_s, stuck_s }: PupilRow) => hand_s ?? stuck_s ?? 0;
  return [...pupils].sort((a, b) => rank(a) - rank(b) || (rank(a) < 2 ? waits(b) - waits(a) : 0));
}

/** What the pupil has saved and works on; each opens as a copy in a tab of the studio. */
function Library({ pupil }: { pupil: PupilRow }) {
  const t = useTexts("class");
  const language = useLanguage();
  const { problem, attempt } = useAttempt();
  const [library, setLibrary] = useState<PupilLibrary | null>(null);
  const show = () => void attempt(async () => setLibrary(await askTeacher("library", { pupil: pupil.id })));
  const when = (saved_at: string) => <span className="quiet small">{new Date(saved_at).toLocaleString(language)}</span>;
  const link = (name: string, text: string) => (
    <a href={`/?${new URLSearchParams({ pupil: pupil.id, project: name }).toString()}`} target="look">
      {text}
    </a>
  );
  return (
    <>
      <Action onClick={show}>{t("showProjects")}</Action>
      <Problem text={problem} />
      {library && !library.draft_at && library.projects.length === 0 && <p className="quiet small">{t("noProjects")}</p>}
      {library && (
        <ul className="stack tight">
          {library.draft_at && (
            <li>
              {link("", t("draft"))} {when(library.draft_at)}
            </li>
          )}
          {library.projects.map(({ name, saved_at }) => (
            <li key={name}>
              {link(name, name)} {when(saved_at)}
            </li>
          ))}
        </ul>
      )}
    </>
  );
}

function Pupil({ pupil }: { pupil: PupilRow }) {
  const t = useTexts("class");
  const lasting = (seconds: number) => (seconds < 60 ? t("seconds", { count: seconds }) : t("minutes", { count: Math.floor(seconds / 60) }));
  const { problem, attempt } = useAttempt();
  const [name, setName] = useState(pupil.name);
  const id = pupil.id;
  const remove = async () => {
    const agreed = await confirm({ title: t("remove"), text: t("removeAsk", { name: pupil.name }), yes: t("remove") });
    if (agreed) await attempt(() => askTeacher("remove", { pupil: id }));
  };
  return (
    <li className={css.pupil} data-away={!pupil.online || undefined}>
      <Avatar name={pupil.avatar} />
      <b>{pupil.name}</b>
      <span className={classes("wrap loose", css.states)}>
        {!pupil.online && <span>{t("awayFor", { time: lasting(pupil.away_s) })}</span>}
        {pupil.hand_s !== null && (
          <span className="row warned">
            <Icon name="hand" /> {t("handFor", { time: lasting(pupil.hand_s) })}
            <Action onClick={() => void attempt(() => askTeacher("lower-hand", { pupil: id }))} aria-label={t("lowerHandOf", { name: pupil.name })}>
              {t("lowerHand")}
            </Action>
          </span>
        )}
        {pupil.stuck_s !== null && <span className="warned">{t("stuckFor", { time: lasting(pupil.stuck_s) })}</span>}
        {pupil.goals > 0 && <span>{t("goalsMet", { met: pupil.goals_met, goals: pupil.goals })}</span>}
        <span aria-label={t("starsCount", { count: pupil.stars })}>★ {pupil.stars}</span>
      </span>
      <a href={`/wall?pupil=${encodeURIComponent(id)}`} target="wall" aria-label={t("showLarge", { name: pupil.name })}>
        {t("show")}
      </a>
      <details className={css.more}>
        <summary aria-label={t("moreOf", { name: pupil.name })}>{t("more")}</summary>
        <div className={css.moreBody}>
          <p>
            {t("numberOf", { name: pupil.name })} <b className="mono">{pupil.number}</b>
            <Action onClick={() => void attempt(() => askTeacher("reset-number", { pupil: id }))}>{t("resetNumber")}</Action>
          </p>
          <Form className="wrap" onSubmit={() => void attempt(() => askTeacher("rename", { pupil: id, name }))}>
            <input value={name} maxLength={20} aria-label={t("newName", { name: pupil.name })} onChange={(event) => setName(event.target.value)} />
            <Action type="submit" disabled={!name.trim() || name === pupil.name}>
              {t("rename")}
            </Action>
          </Form>
          <Library pupil={pupil} />
          <Problem text={problem} />
          <Action danger onClick={() => void remove()}>
            {t("remove")}
          </Action>
        </div>
      </details>
    </li>
  );
}

export function PupilsPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const here = view.pupils.filter(({ online }) => online).length;
  if (view.pupils.length === 0) {
    return (
      <>
        <p role="status">{t("nobodyYet")}</p>
        <HowToJoin view={view} canChange />
      </>
    );
  }
  return (
    <section className="stack" aria-label={t("pupils")}>
      <p role="status">{t("hereCount", { here, all: view.pupils.length })}</p>
      <ul className="stack">
        {byNeed(view.pupils).map((pupil) => (
          <Pupil key={pupil.id} pupil={pupil} />
        ))}
      </ul>
    </section>
  );
}
