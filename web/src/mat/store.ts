/** What the parts of the mat share: the state of the world, the view, and how the document is edited. */

import { create } from "zustand";
import type { CarDetails, Goals, WorldHello, Pose, WorldProblem, WorldState } from "../api/world";
import type { LinkState } from "../api/worldConnection";
import type { CarThought, Decided, Stopped } from "../generated/messages";
import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { record } from "../state/history";
import { useStudio } from "../state/studio";
import { drivesLike, type Mat, type PieceId } from "./document";
import type { PlayState } from "./play";
import type { Scene } from "./scene";

export type Chosen = { car: number } | { piece: PieceId } | null;

interface MatState {
  link: LinkState;
  /** Whether the cars drive. */
  play: PlayState;
  hello: WorldHello | null;
  state: WorldState | null;
  problem: WorldProblem | null;
  /** Which condition stopped the world; null once it goes on. */
  stopped: Stopped | null;
  /** How it stands with the goals of the mission, at the shown time. */
  goals: Goals | null;
  details: CarDetails | null;
  /** What a few cars think at the shown time. */
  thoughts: readonly CarThought[];
  /** What the leaders that decide have come to at the shown time. */
  decisions: readonly Decided[];
  /** The time of the picture that is shown, updated a few times a second. */
  tMs: number;
  past: boolean;
  /** Where the chosen car is in that picture. */
  pose: Pose | null;
  chosen: Chosen;
  /** The cars that a goal tells of, which are ringed like the chosen one. */
  told: readonly number[];
  /** What somebody asked the chosen car: its word as a story and why it does what it does, or its bits; null for nothing. */
  asked: "story" | "bits" | null;
  followed: boolean;
  /** A drag on the stage draws a road. */
  drawing: boolean;
  /** The stage is seen from behind the chosen car, or else the first leader. */
  chase: boolean;
  tracks: boolean;
  air: boolean;
  speed: number;
  seed: number;
  /** The drawn stage, once there is one. */
  scene: Scene | null;
}

export const useMat = create<MatState>(() => ({
  link: "connecting",
  play: "nothing",
  hello: null,
  state: null,
  problem: null,
  stopped: null,
  goals: null,
  details: null,
  thoughts: [],
  decisions: [],
  tMs: 0,
  past: false,
  pose: null,
  chosen: null,
  told: [],
  asked: null,
  followed: false,
  drawing: false,
  chase: false,
  tracks: true,
  air: true,
  speed: 1,
  seed: 0,
  scene: null,
}));

export function choose(chosen: Chosen): void {
  useMat.setState({ chosen, told: [], asked: null, details: null, pose: null, followed: false });
}

/** The car behind which the stage is seen; null while it is seen from above. */
export function chasedCar(mat: MatState): number | null {
  const { chase, hello } = mat;
  return chase && hello?.cars ? Math.min(chosenCar(mat) ?? hello.leads?.[0] ?? 0, hello.cars - 1) : null;
}

/** Draw roads with the next drags, or no more. Meanwhile the camera rests, and shows the whole mat. */
export function drawRoads(drawing: boolean): void {
  const { drawing: before, scene } = useMat.getState();
  if (drawing === before) return;
  useMat.setState({ drawing, ...(drawing && { chase: false, chosen: null }) });
  if (drawing) scene?.showAll();
  else scene?.frame();
}

export function toggleChase(): void {
  useMat.setState(({ chase }) => ({ chase: !chase }));
}

/** The car that is chosen, now or in a state; null where none is. */
export function chosenCar({ chosen } = useMat.getState()): number | null {
  return chosen && "car" in chosen ? chosen.car : null;
}

/** What the chosen car has decided, or else the first that decides; null where none does. */
export function shownDecisions(mat: MatState): Decided | null {
  return mat.decisions.find(({ car }) => car === chosenCar(mat)) ?? mat.decisions[0] ?? null;
}

/** The piece of furniture that is chosen; null where none is. */
export function chosenPiece({ chosen }: MatState): PieceId | null {
  return chosen && "piece" in chosen ? chosen.piece : null;
}

/** Whether a mission fixes mat, cars and infrared; says so where somebody wants to change them. */
export function isFixed(): boolean {
  if (!useStudio.getState().mission) return false;
  notify(say("missions.matStays"));
  return true;
}

/** Change the mat. Edits with the same name one after another, such as the steps of a drag, are undone together. */
export function editMat(mat: Mat, name: string | null = null): void {
  const { mat: before } = useStudio.getState();
  // A mission's floor may look otherwise: that changes no run.
  if (mat === before || (!drivesLike(mat, before) && isFixed())) return;
  const show = (shown: Mat) => () => {
    useMat.setState({ chosen: null });
    useStudio.setState({ mat: shown });
  };
  useStudio.setState({ mat });
  record({ key: name && `mat ${name}`, undo: show(before), redo: show(mat) });
}
