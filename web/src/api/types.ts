/** The shapes that travel between the page and its server. */

/** A language's tag, such as en or zh. */
export type Language = string;
export type EditorName = "leader" | "followers";
export const EDITORS: readonly EditorName[] = ["leader", "followers"];

/** A sentence in every language of the server's; the page picks. */
export interface Sentence {
  en: string;
  [language: Language]: string | undefined;
}

/** Blockly's `serialization.workspaces` state; the page never looks into it but through Blockly. */
export type WorkspaceState = Record<string, unknown>;

/** A motorcade-mat/1 document. */
export interface MatDocument {
  format: "motorcade-mat/1";
  name: string;
  [key: string]: unknown;
}

export interface Profile {
  name: string;
  durations_ms: number[];
  dwell_ms: number[];
  speeds_mm_s: number[];
  turn_rates_deg_s: number[];
  avoid_radii_mm: number[];
  idle_state_ms: number;
  infrared: { range_mm: number; [key: string]: number };
  body: { diameter_mm: number; [key: string]: number };
  seconds: { least: number; step: number; most: number };
}

export interface Field {
  name: string;
  high: number;
  low: number;
  title: Sentence;
}

export interface Formats {
  header: Field[];
  control: Field[];
}

export type Part = "header" | EditorName;

export interface CompiledWord {
  hex: string;
  part: Part;
  values: Record<string, number>;
  block: string | null;
  /** Which block each field comes from, where a word is made of several. */
  fields_of?: Record<string, string>;
}

export interface Diagnostic {
  code: string;
  severity: "error" | "warning";
  message: Sentence;
  path: string;
  block: string | null;
  editor: EditorName | null;
}

export interface Costliest {
  block: string | null;
  count: number;
}

export interface Compiled {
  image: string | null;
  dwell_ms: number;
  states: number;
  follower_words: number;
  most: number;
  costliest: Record<EditorName, Costliest | null>;
  words: CompiledWord[];
  diagnostics: Diagnostic[];
}

/** Both editors' blocks, the car that they are for, and the mat. */
export interface Project {
  leader: WorkspaceState;
  followers: WorkspaceState | null;
  profile: string;
  mat: MatDocument | null;
  /** How far infrared reaches on this mat, in millimetres; null: as far as the profile says. */
  range_mm?: number | null;
}

export interface OpenedProject extends Project {
  name?: string;
}

export interface SavedProject {
  name: string;
  saved_at: string;
  versions: number;
}

export interface Version {
  version: number;
  saved_at: string;
}

export interface Example {
  id: string;
  title: Sentence;
  about: Sentence;
}

export interface Port {
  port: string;
  description: string;
  kind: "serial" | "virtual";
}
