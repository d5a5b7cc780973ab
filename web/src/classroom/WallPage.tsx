/** The projector's pages: all stages at once, one pupil's stage, and the shared mat. */

import { lazy, type ReactNode, useCallback, useEffect, useRef, useState } from "react";
import { type Answer, decodePicture } from "../api/world";
import type { TeacherAbout, ClassWall, WallWorld } from "../generated/classroom";
import type { Goals, Sentence } from "../generated/messages";
import { inLanguage, type KeyIn, useTexts } from "../i18n";
import { Action, Page, Problem } from "../ui/page";
import { Later } from "../ui/panes";
import { titleOr, useAttempt } from "./attempt";
import { askTeacher, ClassStream } from "./ask";
import { Avatar } from "./Avatar";
import { Tiles } from "./drawing";
import { HowToJoin } from "./HowToJoin";
import { AllStages } from "./Stages";
import { useClass } from "./useClass";
import { WorldCanvas } from "./WorldCanvas";
import buttons from "../ui/buttons.module.css";
import css from "./class.module.css";

const ShownBlocks = lazy(() => import("./ShownBlocks"));

/** Show the children to who has signed in as the teacher in this browser, and to others the way there. */
function TeacherOnly({ title, children }: { title: KeyIn<"class">; children: ReactNode }) {
  const t = useTexts("class");
  const [about, setAbout] = useState<TeacherAbout | null>(null);
  const { problem, attempt } = useAttempt();
  useEffect(() => {
    void attempt(async () => setAbout(await askTeacher("about")));
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, []);
  if (about?.signed_in) return children;
  return (
    <Page title={t(title)} className={css.narrow}>
      <Problem text={problem} />
      {about && (
        <p>
          {t("projectorNeedsTeacher")} <a href="/teacher">{t("teacherTitle")}</a>
        </p>
      )}
    </Page>
  );
}

interface LargeProps {
  path: string;
  label: string;
  /** What stands above the leaders, in their order. */
  names?: readonly string[];
  /** Whether the page may play, pause and reset it. */
  playable?: boolean;
}

/** One world as large as the page, with the goals of its mission. */
function LargeWorld({ path, label, names, playable = false }: LargeProps) {
  const t = useTexts("class");
  const [world, setWorld] = useState<WallWorld | null>(null);
  const [goals, setGoals] = useState<Goals | null>(null);
  const [playing, setPlaying] = useState(false);
  const [open, setOpen] = useState(true);
  const [refused, setRefused] = useState<Sentence | null>(null);
  const [tiles] = useState(() => new Tiles());
  const stream = useRef<ClassStream<Answer | ClassWall> | null>(null);
  useEffect(() => {
    let shown: WallWorld | null = null;
    const opened = new ClassStream<Answer | ClassWall>(path, {
      onAnswer: (answer) => {
        if (answer.is === "wall") {
          shown = answer.worlds[0] ?? null;
          tiles.forget();
          setWorld(shown);
        }
        if (answer.is === "goals") setGoals(answer);
        if (answer.is === "state") setPlaying(answer.playing);
        if (answer.is === "error") setRefused(answer.sentence);
      },
      onBytes: (bytes) => {
        const picture = decodePicture(bytes);
        if (!picture) return;
        if (shown) tiles.show(shown.pupil, picture);
        requestAnimationFrame(() => opened.send({ do: "shown", frame: picture.frame }));
      },
      onLink: setOpen,
    });
    stream.current = opened;
    return () => opened.close();
  }, [path, tiles]);
  // A list that React makes anew with each message must not draw the world anew.
  const key = names?.join("\n") ?? "";
  const nameOf = useCallback((car: number) => key.split("\n")[world?.leads.indexOf(car) ?? -1], [key, world]);
  return (
    <section className={css.large}>
      {!open && <p className="caution">{t("linkLost")}</p>}
      {refused && <p className="caution">{inLanguage(refused)}</p>}
      {world ? (
        <WorldCanvas world={world} label={label} nameOf={nameOf} tiles={tiles} className={css.world} />
      ) : (
        <p className="caution">{t("noWorldYet")}</p>
      )}
      {goals && (
        <ul className={css.goals}>
          {goals.goals.map((goal, place) => (
            <li key={place} data-progress={goal.progress}>
              {goal.progress === "met" ? "✓ " : ""}
              {world?.goals[place] && inLanguage(world.goals[place].text)}
              {goal.progress === "lost" && <span>: {inLanguage(goal.why)}</span>}
            </li>
          ))}
        </ul>
      )}
      {playable && (
        <div className="wrap">
          <Action primary onClick={() => stream.current?.send(playing ? { do: "pause" } : { do: "play", speed: 1 })}>
            {t(playing ? "pause" : "play")}
          </Action>
          <Action onClick={() => stream.current?.send({ do: "reset", seed: 0 })}>{t("again")}</Action>
        </div>
      )}
    </section>
  );
}

/** All stages, or the one of the pupil that the address names. */
function WallPage() {
  const t = useTexts("class");
  const { view, open } = useClass();
  const id = new URLSearchParams(location.search).get("pupil");
  const pupil = view?.pupils.find((each) => each.id === id);
  if (id === null)
    return (
      <Page title={titleOr(view?.title, t("wallTitle"))} tools={<b className={css.code}>{view?.code}</b>} className={css.wide}>
        {view && !open && <p className="caution">{t("linkLost")}</p>}
        {view && <AllStages pupils={view.pupils} mat={view.mat} />}
        {view?.pupils.length === 0 && <HowToJoin view={view} />}
      </Page>
    );
  return (
    <Page
      title={pupil ? t("stageOf", { name: pupil.name }) : t("wallTitle")}
      tools={<a className={buttons.button} href="/wall">{t("allStages")}</a>}
      className={css.wide}
    >
      {view && !pupil && <p className="caution">{t("pupilGone")}</p>}
      {pupil && (
        <div className={css.shown}>
          <LargeWorld path={`/api/teacher/watch?pupil=${encodeURIComponent(pupil.id)}`} label={t("stageOf", { name: pupil.name })} />
          <Later>
            <ShownBlocks pupil={pupil.id} />
          </Later>
        </div>
      )}
    </Page>
  );
}

export const Wall = () => (
  <TeacherOnly title="wallTitle">
    <WallPage />
  </TeacherOnly>
);

export const SharedMat = () => (
  <TeacherOnly title="matTitle">
    <MatPage />
  </TeacherOnly>
);

/** The mat that all pupils share, with their names above their leaders. */
function MatPage() {
  const t = useTexts("class");
  const { view } = useClass();
  const { problem, attempt } = useAttempt();
  const entries = view?.mat.entries.map((id) => view.pupils.find((pupil) => pupil.id === id)) ?? [];
  const title = view && view.mat.state !== "closed" ? inLanguage(view.mat.title) : t("matTitle");
  return (
    <Page title={title} tools={<b className={css.code}>{view?.code}</b>} className={css.wide}>
      {view?.mat.state === "closed" && <p className="caution">{t("matClosed")}</p>}
      {view?.mat.state === "collecting" && (
        <>
          <p className="caution" aria-live="polite">
            {t("matCollecting", { count: entries.length, places: view.mat.places })}
          </p>
          <ul className={css.names}>
            {entries.map(
              (pupil) =>
                pupil && (
                  <li key={pupil.id} className="row">
                    <Avatar name={pupil.avatar} />
                    {pupil.name}
                  </li>
                ),
            )}
          </ul>
          <Action primary disabled={entries.length === 0} onClick={() => void attempt(() => askTeacher("mat/start"))}>
            {t("matStart")}
          </Action>
          <Problem text={problem} />
        </>
      )}
      {(view?.mat.state === "running" || view?.mat.state === "over") && (
        <LargeWorld path="/api/teacher/mat" label={title} names={entries.map((pupil) => pupil?.name ?? "")} playable />
      )}
    </Page>
  );
}
