/** The types of messages between the page and its service, under the names that the page uses. */

import type { FORMATS } from "../generated/steps";
import type { MissionChoice, Compiled as Answer, Project as WholeProject, ProfileFigures, Word } from "../generated/messages";

export type {
  Capabilities,
  Costliest,
  Diagnostic,
  Example,
  Language,
  LibraryEntry as SavedProject,
  MatDocument,
  MissionChoice,
  Port,
  Sentence,
  Version,
  WorkspaceState,
} from "../generated/messages";

export type EditorName = "leader" | "followers";
export const EDITORS: readonly EditorName[] = ["leader", "followers"];
/** A field of a word: its first and its last bit. */
export interface Field {
  readonly name: (typeof FORMATS)[keyof typeof FORMATS][number]["name"];
  readonly high: number;
  readonly low: number;
}
export type Part = Word["part"];
export type CompiledWord = Word;
export type Compiled = Omit<Answer, "timeline">;
export type Profile = Omit<ProfileFigures, "serial" | "servo" | "motor" | "drive">;

/** Both editors' blocks, the car that they are for, and the mat. */
export type Project = WholeProject;

export interface OpenedProject extends Omit<Project, "python" | "level"> {
  name?: string;
  /** The version of the library that it is. */
  version?: number;
  mission?: MissionChoice | null;
  python?: string | null;
  level?: Project["level"];
}
