/** What the mat's parts share: how the world goes, what is chosen, and the document that is being edited. */

import { create } from "zustand";
import type { CarDetails, Hello, Link, Picture, Pose, WorldProblem, WorldState } from "../api/world";
import type { Mat, PieceId } from "./document";

export type Chosen = { car: number } | { piece: PieceId } | null;

export interface MatState {
  link: Link;
  hello: Hello | null;
  state: WorldState | null;
  problem: WorldProblem | null;
  /** The world waits for the simulator, which is being compiled. */
  compiling: boolean;
  details: CarDetails | null;
  /** Of the picture that is shown, told a few times a second. */
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
  /** null: as far as the profile says. */
  rangeMm: number | null;

  mat: Mat;
  undo: readonly Mat[];
  redo: readonly Mat[];
}

const MOST_UNDO = 100;

export const useMat = create<MatState>(() => ({
  link: "connecting",
  hello: null,
  state: null,
  problem: null,
  compiling: false,
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
  rangeMm: null,
  mat: { format: "motorcade-mat/1", name: "Table" },
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

/** Another document, as after opening a project: nothing of before can be undone. */
export function loadMat(mat: Mat): void {
  useMat.setState({ mat, undo: [], redo: [], chosen: null });
}

let merging: string | null = null;

/** Edits with the same name one after another, such as the steps of a drag, are undone together. */
export function editMat(mat: Mat, name: string | null = null): void {
  const { mat: before, undo } = useMat.getState();
  if (mat === before) return;
  const joins = name !== null && name === merging;
  merging = name;
  useMat.setState({ mat, undo: joins ? undo : [...undo, before].slice(-MOST_UNDO), redo: [] });
}

/** What comes next is another edit, even where it has the same name. */
export function endEdit(): void {
  merging = null;
}

export function undoEdit(): void {
  const { mat, undo, redo } = useMat.getState();
  endEdit();
  if (undo.length) useMat.setState({ mat: undo.at(-1)!, undo: undo.slice(0, -1), redo: [...redo, mat], chosen: null });
}

export function redoEdit(): void {
  const { mat, undo, redo } = useMat.getState();
  endEdit();
  if (redo.length) useMat.setState({ mat: redo.at(-1)!, redo: redo.slice(0, -1), undo: [...undo, mat], chosen: null });
}

/** Called with each picture: too often for React. */
export type OnPicture = (picture: Picture) => void;
