/**
 * A pupil's part of a class: what the class's server tells this page, and the draft that the server keeps. The teacher looks
 * at a pupil's project by a copy of it, in a tab of its own.
 */

import { create } from "zustand";
import type { OpenedProject } from "../api/types";
import { askClass, askTeacher, ClassStream } from "../classroom/ask";
import type { ClassAnswer, Goodbye, News, PupilView } from "../generated/classroom";
import { inLanguage, say } from "../i18n";
import { choiceOf, playMission } from "../missions/store";
import { usePair } from "../pair/store";
import { attempt, openSaved } from "../projects/actions";
import { askUnlessSaved, autosave, type StoredWork } from "../projects/autosave";
import { Keeper, type Place } from "../projects/keeper";
import { openProject, sameProject } from "../projects/project";
import { notify } from "../state/dialogs";
import { own } from "../state/otherTabs";
import { useStudio } from "../state/studio";

interface Pupil {
  view: PupilView | null;
  /** Why this page is no longer in the class. */
  goodbye: Goodbye["why"] | null;
  /** The number of the last news that a notice has told of. */
  told: number;
}

export const usePupil = create<Pupil>(() => ({ view: null, goodbye: null, told: 0 }));

const DRAFT_AFTER_MS = 2000;
const DRAFT_AGAIN_MS = 5000;

/**
 * The pupil's newest work: of this tab, or the draft that the server keeps. The draft of another tab of this device takes
 * nothing from this one; that of another device gets a place of its own, so that what lies at this tab's place stays.
 */
export async function findPupilsWork(): Promise<StoredWork | null> {
  const { me } = await askClass("about").catch(() => ({ me: null }));
  const stored = await autosave.find(me?.id);
  const draft = await askClass("draft/read").catch(() => null);
  if (!draft?.project || (stored && stored.at >= Date.parse(draft.saved_at))) return stored;
  if (stored && draft.place !== own.place) {
    if (localStorage.getItem(draft.place) !== null) return stored;
    autosave.takeNew();
  }
  return { ...draft.project, name: draft.name, mission: draft.mission, parkedFollowers: null, unsaved: true, at: Date.parse(draft.saved_at) };
}

/** Run a task; show a refusal of the class's server as a notice, also where it doesn't answer. */
export function attemptInClass(task: () => Promise<unknown>): Promise<unknown> {
  return attempt(task, () => notify(say("pupil.noAnswer"), "error"));
}

/** The draft that the class's server keeps; one that it refuses is written with the next edit. */
export const draft: Place = {
  concerns: (now, before) => !sameProject(now, before),
  async write() {
    // Who is no longer in the class would be led away from the page that says why.
    if (usePupil.getState().goodbye) return;
    const project = openProject();
    const { name, mission } = useStudio.getState();
    await askClass("draft/write", { name, project, place: own.place, mission });
  },
};

/** Tell of news by notices; `told` is the number of the last one that was told of. */
function tellNews(news: readonly News[]): void {
  const { told } = usePupil.getState();
  for (const { number, kind, name, sender } of news.filter((each) => each.number > told)) {
    usePupil.setState({ told: number });
    const title = typeof name === "string" ? name : inLanguage(name);
    const text = kind === "mission" ? say("pupil.mission", { name: title }) : say("pupil.project", { name: title, sender: sender || say("pupil.teacher") });
    const open = kind === "mission" ? openHandedMission : () => attempt(() => openSaved(title));
    notify(text, "info", { label: say("pupil.open"), run: () => void open() });
    void askClass("seen", { number }).catch(() => undefined);
  }
}

/** Open the mission that was handed out last. */
export async function openHandedMission(): Promise<void> {
  const number = usePupil.getState().view?.mission ?? null;
  if (number === null) return;
  await attemptInClass(async () => {
    await playMission(choiceOf(await askClass("mission", { number })));
  });
}

/** What follows a pair is loaded only where there is one. */
function receivePair({ pair, me }: PupilView): void {
  if (pair || usePair.getState().view) void import("../pair/follow").then(({ receive }) => receive(pair, me.id));
}

function receive(answer: ClassAnswer): void {
  if (answer.is === "pupil") {
    usePupil.setState({ view: answer });
    tellNews(answer.news);
    receivePair(answer);
  } else if (answer.is === "goodbye") usePupil.setState({ goodbye: answer.why });
}

/** Follow the class from now on. To be called once. */
export function startPupil(): void {
  new ClassStream<ClassAnswer>("/api/class/stream", { onAnswer: receive });
  new Keeper(draft, DRAFT_AFTER_MS, DRAFT_AGAIN_MS).start();
}

/** The pupil's id, and the name of the project; an empty one for the draft. */
interface Looking {
  pupil: string;
  project: string;
}

/** What an address of the studio says of a pupil's project: `/?pupil=01&project=Robot`. */
export function lookingIn(search: string): Looking | null {
  const asked = new URLSearchParams(search);
  const pupil = asked.get("pupil");
  return pupil ? { pupil, project: asked.get("project") ?? "" } : null;
}

/** Which project this tab shows to the teacher; null for a studio of one's own. */
export const looking = () => (useStudio.getState().capabilities?.classroom === "teacher" ? lookingIn(location.search) : null);

/** A copy of a pupil's project. Throws RefusedError or UnreachableError. It is not in the teacher's library, so it has no version there. */
export async function lookAt({ pupil, project }: Looking): Promise<StoredWork> {
  const found: OpenedProject = await askTeacher("project", { pupil, name: project });
  // This browser keeps nothing of it.
  window.addEventListener("beforeunload", askUnlessSaved);
  return { ...found, name: found.name ?? "", version: undefined, parkedFollowers: null, unsaved: false, stored: true, at: Date.now() };
}
