/** What the page's parts share. Blockly's workspaces own the blocks; here is their latest state. */

import { create } from "zustand";
import type { Capabilities, Compiled, EditorName, Formats, MatDocument, Profile, WorkspaceState } from "../api/types";
import { EMPTY_MAT } from "../projects/blank";

export interface Selection {
  editor: EditorName;
  block: string;
}

/** The areas of the page, of which a narrow screen shows one at a time. */
export type View = EditorName | "words" | "mat";

export interface Studio {
  name: string;
  leader: WorkspaceState;
  /** null where only the leader is programmed. */
  followers: WorkspaceState | null;
  /** The followers' blocks that were put aside when they were switched off, until they are wanted again. */
  parkedFollowers: WorkspaceState | null;
  profile: string;
  mat: MatDocument;
  /** How far infrared reaches, in millimetres; null: as far as the profile says. */
  rangeMm: number | null;
  /** Whether there is anything that neither a file nor the library holds yet. */
  unsaved: boolean;
  /** Counts projects opened: the editors fill themselves anew with each. */
  generation: number;

  profileFigures: Profile | null;
  formats: Formats | null;
  /** What the shell that answers can do. */
  capabilities: Capabilities | null;
  compiled: Compiled | null;
  selection: Selection | null;
  running: ReadonlyMap<EditorName, readonly string[]>;
  serverGone: boolean;
  view: View;
}

export const useStudio = create<Studio>(() => ({
  name: "",
  leader: {},
  followers: null,
  parkedFollowers: null,
  profile: "classroom",
  mat: EMPTY_MAT,
  rangeMm: null,
  unsaved: false,
  generation: 0,
  profileFigures: null,
  formats: null,
  capabilities: null,
  compiled: null,
  selection: null,
  running: new Map(),
  serverGone: false,
  view: "leader",
}));
