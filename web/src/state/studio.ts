/** The open project, what it was compiled to, and which part of the page is shown. */

import { useDeferredValue } from "react";
import { create } from "zustand";
import type { Capabilities, CompiledBlocks, CompiledWord, EditorName, MeasuredCar, MissionChoice, Profile, WorkspaceState } from "../api/types";
import { request, type ServiceState } from "../api/service";
import type { Mat } from "../generated/world";
import { useSettings } from "./settings";

interface Selection {
  editor: EditorName;
  block: string;
}

export interface Studio {
  name: string;
  /** Blockly's workspaces own the blocks; this is their latest state. */
  leader: WorkspaceState;
  /** null where only the leader is programmed. */
  followers: WorkspaceState | null;
  /** The followers' blocks after they were switched off, to be put back when they are switched on again. */
  parkedFollowers: WorkspaceState | null;
  profile: string;
  mat: Mat;
  /** The program's Python text with its comments; null until somebody opens it. */
  python: string | null;
  /** How far infrared reaches, in millimetres; null: as far as the profile says. */
  rangeMm: number | null;
  /** The cars drive as this one, which was measured; null: as the profile says. */
  car: MeasuredCar | null;
  /** The mission that the project is played for. */
  mission: MissionChoice | null;
  /** The user's own project, as it stood when a mission was opened. */
  kept: OwnProject | null;
  /** The blocks with which missions were left, by mission. */
  attempts: Readonly<Record<string, Pick<Studio, "leader" | "followers">>>;
  /** Whether the project differs from what a file or the library holds. */
  unsaved: boolean;
  /** Whether a file or the library holds a version of it. */
  stored: boolean;
  /** The version of the library that the project was made from; null for none. */
  base: { name: string; version: number } | null;
  /** The project is what a first visit finds. */
  isOpening: boolean;
  /** Counts the projects opened: with each, the editors are filled anew. */
  generation: number;

  /** All kinds of cars. */
  profiles: readonly Profile[];
  /** The figures of the project's cars. */
  profileFigures: Profile | null;
  /** What the shell that answers can do. */
  capabilities: Capabilities | null;
  compiled: CompiledBlocks | null;
  selection: Selection | null;
  /** The first blocks of stacks that are attached to no hat. */
  loose: readonly Selection[];
  /** The blocks that some car executes now. */
  running: ReadonlyMap<EditorName, readonly string[]>;
  /** Whether requests are answered. */
  service: ServiceState;
  /** The editor that shows where there is no room for both. */
  editor: EditorName;
  /** Which of the two is the larger one where the stage lies above the blocks. */
  larger: "stage" | "blocks";
  /** The stage fills the page: for one, or with large labels for a class. */
  alone: "full" | "projector" | null;
  /** Sound in the projector view, which is silent unless somebody asks for it. */
  loudProjector: boolean;
}

const OWN_PARTS = ["name", "leader", "followers", "parkedFollowers", "profile", "mat", "python", "rangeMm", "car", "unsaved", "stored", "base"] as const;
type OwnProject = Pick<Studio, (typeof OWN_PARTS)[number]>;

/** What is the user's own of what the page holds. */
export const ownProject = (studio: Studio): OwnProject => Object.fromEntries(OWN_PARTS.map((part) => [part, studio[part]])) as unknown as OwnProject;

export const EMPTY_MAT: Mat = {
  format: "motorcade-mat/1",
  name: "Table",
  size_m: [4, 3],
  edge: "wall",
  car: [{ at_m: [2.3, 1.5], role: "leader" }],
  crowd: [{ cars: 12, corner_m: [0.8, 1.05], size_m: [1.2, 0.9], spacing_m: 0.3 }],
};

export const useStudio = create<Studio>(() => ({
  name: "",
  leader: {},
  followers: null,
  parkedFollowers: null,
  profile: "classroom",
  mat: EMPTY_MAT,
  python: null,
  rangeMm: null,
  car: null,
  mission: null,
  kept: null,
  attempts: {},
  unsaved: false,
  stored: false,
  base: null,
  isOpening: false,
  generation: 0,
  profiles: [],
  profileFigures: null,
  capabilities: null,
  compiled: null,
  selection: null,
  loose: [],
  running: new Map(),
  service: "ready",
  editor: "leader",
  larger: "stage",
  alone: null,
  loudProjector: false,
}));

/** Load what the page needs before anything can be drawn: what the service can do, and the figures of the cars' profile. */
export async function loadFigures(): Promise<void> {
  const [capabilities, profiles] = await Promise.all([request("capabilities"), request("profiles")]);
  useStudio.setState({ capabilities, profiles });
}

useStudio.subscribe((now, before) => {
  const { profile, car, profiles } = now;
  if (profile === before.profile && car === before.car && profiles === before.profiles) return;
  const kind = profiles.find(({ name }) => name === profile);
  useStudio.setState({ profileFigures: kind ? { ...kind, ...(car && { speeds_mm_s: car.speeds_mm_s, turn_rates_deg_s: car.turn_rates_deg_s }) } : null });
});

const NO_WORDS: readonly CompiledWord[] = [];

/** The words of the program, a moment late after an edit, so that the table which shows them comes first. */
export function useWords(): readonly CompiledWord[] {
  return useDeferredValue(useStudio(({ compiled }) => compiled?.words ?? NO_WORDS));
}

/** Let the stage fill the page, and the screen where the browser allows it; null: show all of the page again. */
export function showAlone(alone: Studio["alone"]): void {
  useStudio.setState({ alone, loudProjector: false });
  const { documentElement, fullscreenElement } = document;
  // A phone may not know this.
  const page = documentElement as Partial<HTMLElement>;
  if (alone && !fullscreenElement) void page.requestFullscreen?.call(documentElement).catch(() => undefined);
  else if (!alone && fullscreenElement) void document.exitFullscreen();
}

/** Whether the stage sounds now. */
export function isHeard(): boolean {
  const { alone, loudProjector } = useStudio.getState();
  return useSettings.getState().sound && (alone !== "projector" || loudProjector);
}

export function toggleSound(): void {
  const sound = !isHeard();
  useSettings.setState({ sound });
  useStudio.setState({ loudProjector: sound });
}
