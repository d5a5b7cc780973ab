/** The requests of the page, each as a function. */

import { useStudio } from "../state/studio";
import type { Blocks, BlocksAndText, CureOrder, MissionAttempt, MissionChoice, Project, Requests } from "../generated/messages";
import { service } from "./service";

export { RefusedError, UnreachableError } from "./service";

const ask = <Name extends keyof Requests>(
  name: Name,
  message: Requests[Name]["message"] | null = null,
): Promise<Requests[Name]["answer"]> => service().ask(name, message);

export const capabilities = () => ask("capabilities");
export const profiles = () => ask("profiles");
export const compile = (blocks: Blocks) => ask("compile", blocks);
export const blocksToPython = (message: BlocksAndText) => ask("blocks-to-python", message);
export const pythonToBlocks = (message: BlocksAndText) => ask("python-to-blocks", message);
/** What the cure that 'Why?' names changes. */
export const cured = (order: CureOrder) => ask("cure", order);
export const open = (text: string) => ask("open", { text });
export const projectText = (project: Project) => ask("save-text", project);
export const decompile = (image: string) => ask("decompile", { image });
export const projects = () => ask("projects/list");
/** `base`: the version that the project was made from, 0 for none; null: store it whatever the newest version is. */
export const saveProject = (name: string, project: Project, base: number | null) =>
  ask("projects/write", { name, project, base });
export const exportProjects = () => ask("projects/export");
export const importProjects = (text: string) => ask("projects/import", { text });
export const place = () => ask("projects/place");
export const savedProject = (name: string, version?: number) => ask("projects/read", { name, version: version ?? null });
export const versions = (name: string) => ask("projects/history", { name });
export const deleteProject = (name: string) => ask("projects/delete", { name });
export const examples = () => ask("examples");
export const example = (id: string) => ask("example", { id });
export const missions = () => ask("missions");
export const mission = (choice: MissionChoice) => ask("mission", choice);
export const openMission = (text: string) => ask("missions/open", { text });
export const missionText = (choice: MissionChoice) => ask("missions/save-text", choice);
export const checkMission = (attempt: MissionAttempt) => ask("missions/check", attempt);
export const ownMissions = () => ask("missions/own");
export const ownMission = (name: string) => ask("missions/read", { name });
export const saveMission = (name: string, document: Record<string, unknown>) => ask("missions/write", { name, document });
export const deleteMission = (name: string) => ask("missions/delete", { name });
/** `rows`: base64 of rows of events. */
export const eventTable = (rows: string) => ask("event-table", { rows });
export const ports = () => ask("ports");

/** What the page needs before anything can be drawn. */
export async function loadFigures(): Promise<void> {
  const name = useStudio.getState().profile;
  const [can, known] = await Promise.all([capabilities(), profiles()]);
  const profileFigures = known.find((profile) => profile.name === name) ?? null;
  useStudio.setState({ capabilities: can, profileFigures });
}
