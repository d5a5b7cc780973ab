/** What the parts of the mat share: the state of the world, the view, and the edits of the document that can be undone. */

import { create } from "zustand";
import type { CarDetails, Hello, Link, Pose, WorldProblem, WorldState } from "../api/world";
import { useStudio } from "../state/studio";
import type { Mat, PieceId } from "./document";

export type Chosen = { car: number } | { piece: PieceId } | null;

export interface MatState {
  link: Link;
  hello: Hello | null;
  state: WorldState | null;
  problem: WorldProblem | null;
  /** The world waits for the simulator to be compiled. */
  details: CarDetails | null;
  /** The time of the picture that is shown, updated a few times a second. */
  tMs: number;
  past: boolean;
  /** Where the chosen car is in that picture. */
  pose: Pose | null;
  chosen: Chosen;
  followed: boolean;
  tracks: boolean;
  air: boolean;
  speed: number;
  seed: number;
  /** Earlier and later versions of the project's mat, which itself is `useStudio.mat`. */
  undo: readonly Mat[];
  redo: readonly Mat[];
}

const MOST_UNDO = 100;

export const useMat = create<MatState>(() => ({
  link: "connecting",
  hello: null,
  state: null,
  problem: null,
  details: null,
  tMs: 0,
  past: false,
  pose: null,
  chosen: null,
  followed: false,
  tracks: true,
  air: true,
  speed: 1,
  seed: 0,
  undo: [],
  redo: [],
}));

export function choose(chosen: Chosen): void {
  useMat.setState({ chosen, details: null, pose: null, followed: false });
}

export function chosenCar(): number | null {
  const { chosen } = useMat.getState();
  return chosen && "car" in chosen ? chosen.car : null;
}

/** The last edit's name, as long as another edit with this name belongs to it. */
let joining: string | null = null;

/** Change the mat. Edits with the same name one after another, such as the steps of a drag, are undone together. */
export function editMat(mat: Mat, name: string | null = null): void {
  const { mat: before } = useStudio.getState();
  if (mat === before) return;
  const joins = name !== null && name === joining;
  joining = name;
  useMat.setState(({ undo }) => ({ undo: joins ? undo : [...undo, before].slice(-MOST_UNDO), redo: [] }));
  useStudio.setState({ mat });
}

/** The next edit is a new one, even if it has the same name. */
export function endEdit(): void {
  joining = null;
}

/** Another project was opened: its mat has no earlier versions. */
export function forgetEdits(): void {
  endEdit();
  useMat.setState({ undo: [], redo: [], chosen: null });
}

export function undoEdit(): void {
  const { undo, redo } = useMat.getState();
  const { mat } = useStudio.getState();
  endEdit();
  if (!undo.length) return;
  useMat.setState({ undo: undo.slice(0, -1), redo: [...redo, mat], chosen: null });
  useStudio.setState({ mat: undo.at(-1)! });
}

export function redoEdit(): void {
  const { undo, redo } = useMat.getState();
  const { mat } = useStudio.getState();
  endEdit();
  if (!redo.length) return;
  useMat.setState({ redo: redo.slice(0, -1), undo: [...undo, mat], chosen: null });
  useStudio.setState({ mat: redo.at(-1)! });
}
