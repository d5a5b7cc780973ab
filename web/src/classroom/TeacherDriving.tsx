/** Where programs drive: the cable and the real cars, who has them, and the emergency stop; and the shared mat. */

import { useEffect, useRef, useState } from "react";
import type { ClassProgress, ClassView } from "../generated/classroom";
import type { CompiledBlocks, StoredProject } from "../generated/messages";
import { post } from "../api/connection";
import { CarList } from "../cars/CarList";
import { useTexts } from "../i18n";
import buttons from "../ui/buttons.module.css";
import { Action, Choice, Problem } from "../ui/page";
import { useAttempt } from "./attempt";
import { askTeacher } from "./ask";
import { MissionOptions } from "./TeacherCheck";
import { useOwnProjects } from "./TeacherWork";
import css from "./class.module.css";

const NOBODY = "";

export function CarsPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [missed, setMissed] = useState<readonly string[]>([]);
  const stop = () => attempt(async () => setMissed(await askTeacher("stop-all")));
  return (
    <section className="stack loose" aria-label={t("cars")}>
      <div className="wrap">
        {view.stopped ? (
          <Action onClick={() => void attempt(() => askTeacher("release-all"))}>{t("releaseAll")}</Action>
        ) : (
          <Action danger onClick={() => void stop()}>
            {t("stopAll")}
          </Action>
        )}
        {view.stopped && <b role="status">{t("allStopped")}</b>}
      </div>
      {view.stopped && missed.length > 0 && <p className="wrong">{t("notReached", { cars: missed.join(", ") })}</p>}
      <Problem text={problem} />
      {view.shared.map(({ name, holder }) => (
        <Choice
          key={name}
          label={name || t("cable")}
          value={holder ?? NOBODY}
          onChange={(pupil) => void attempt(() => askTeacher("pass-on", { name, pupil: pupil || null }))}
        >
          <option value={NOBODY}>{t("nobody")}</option>
          {view.pupils.map((pupil) => (
            <option key={pupil.id} value={pupil.id}>
              {pupil.name}
            </option>
          ))}
        </Choice>
      ))}
      {view.shared.length === 1 && <p className="quiet small">{t("noRealCars")}</p>}
      <h2>{t("programmedCars")}</h2>
      <p className="quiet small">{t("programmedCarsAbout")}</p>
      <ProgrammedCars />
    </section>
  );
}

const NO_PROJECT = "";
const NO_IMAGE = "";

/** The image of one of the teacher's projects; null where its blocks are wrong. Throws RefusedError or UnreachableError. */
async function imageOf(name: string): Promise<string | null> {
  const { leader, followers, profile } = (await post("/api/projects/read", { name })) as StoredProject;
  return ((await post("/api/compile", { leader, followers, profile })) as CompiledBlocks).image;
}

/** The cars that run programs, and which of the teacher's projects they are loaded with. */
function ProgrammedCars() {
  const t = useTexts("class");
  const projects = useOwnProjects();
  const { problem, attempt } = useAttempt();
  const [name, setName] = useState(NO_PROJECT);
  const [image, setImage] = useState<string | null>(NO_IMAGE);
  const wanted = useRef(name);
  const choose = (chosen: string) => {
    wanted.current = chosen;
    setName(chosen);
    setImage(NO_IMAGE);
    if (!chosen) return;
    void attempt(async () => {
      const found = await imageOf(chosen);
      // Another one may have been chosen meanwhile: no car gets this one under that one's name.
      if (wanted.current === chosen) setImage(found);
    });
  };
  return (
    <>
      <Choice label={t("carProject")} value={name} onChange={choose}>
        <option value={NO_PROJECT}>{t("chooseProject")}</option>
        {projects.map((project) => (
          <option key={project.name}>{project.name}</option>
        ))}
      </Choice>
      <Problem text={image === null ? t("wrongProject", { name }) : problem} />
      <CarList path="/api/teacher/cars" image={image ?? NO_IMAGE} program={name} stopsElsewhere />
    </>
  );
}

const MOST_FOLLOWERS = 10;
const FREE = "";

export function MatPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const { problem, attempt } = useAttempt();
  const [missions, setMissions] = useState<ClassProgress["missions"]>([]);
  const [mission, setMission] = useState(FREE);
  const [followers, setFollowers] = useState(2);
  useEffect(() => void askTeacher("progress").then((progress) => setMissions(progress.missions), () => undefined), []);
  const { mat } = view;
  const open = () => askTeacher("mat/open", mission === FREE ? { followers } : { mission: { id: mission } });
  return (
    <section className="stack" aria-label={t("mat")}>
      <p>{t("matAbout")}</p>
      {mat.state === "closed" ? (
        <div className="wrap">
          <Choice label={t("matKind")} value={mission} onChange={setMission}>
            <option value={FREE}>{t("matFree")}</option>
            <MissionOptions missions={missions} />
          </Choice>
          {mission === FREE && (
            <Choice label={t("followersEach")} value={followers} onChange={(count) => setFollowers(Number(count))}>
              {Array.from({ length: MOST_FOLLOWERS + 1 }, (_, count) => (
                <option key={count}>{count}</option>
              ))}
            </Choice>
          )}
          <Action primary onClick={() => void attempt(open)}>
            {t("matOpen")}
          </Action>
        </div>
      ) : (
        <>
          <p role="status">{t("matCollecting", { count: mat.entries.length, places: mat.places })}</p>
          <ol className={css.points}>
            {mat.entries.map((id) => (
              <li key={id}>{view.pupils.find((pupil) => pupil.id === id)?.name ?? id}</li>
            ))}
          </ol>
          <div className="wrap">
            {mat.state === "collecting" && (
              <Action primary disabled={mat.entries.length === 0} onClick={() => void attempt(() => askTeacher("mat/start"))}>
                {t("matStart")}
              </Action>
            )}
            <a className={buttons.button} href="/mat" target="mat">
              {t("matShow")}
            </a>
            <Action onClick={() => void attempt(() => askTeacher("mat/close"))}>{t("matClose")}</Action>
          </div>
        </>
      )}
      <Problem text={problem} />
    </section>
  );
}
