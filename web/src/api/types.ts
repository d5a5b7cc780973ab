/** The types of messages between the page and its service, under the names that the page uses. */

import type { FORMATS } from "../generated/steps";
import type { MissionChoice, Project } from "../generated/messages";

export type {
  Capabilities,
  CompiledBlocks,
  Costliest,
  Diagnostic,
  Example,
  Language,
  LibraryEntry as SavedProject,
  MissionChoice,
  Port,
  MeasuredCar,
  ProfileFigures as Profile,
  Project,
  Sentence,
  Version,
  Word as CompiledWord,
  WorkspaceState,
} from "../generated/messages";

export type EditorName = "leader" | "followers";
export const EDITORS: readonly EditorName[] = ["leader", "followers"];
/** A field of a word: its bits, the group that also determines its colour, and what its value means. */
export type Field = (typeof FORMATS)[keyof typeof FORMATS][number];
export interface OpenedProject extends Omit<Project, "python" | "level" | "car"> {
  name?: string;
  /** The version of the library that it is. */
  version?: number;
  mission?: MissionChoice | null;
  python?: string | null;
  level?: Project["level"];
  car?: Project["car"];
}
