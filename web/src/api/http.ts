/** Requests to the server. When it doesn't answer, the store's `serverGone` becomes true until it answers again. */

import { useStudio } from "../state/studio";
import type { Blocks, BlocksAndText, ErrorAnswer, MissionAttempt, MissionChoice, Project, Requests, Sentence } from "../generated/messages";

/** The server refused a request; its sentence says why. */
export class RefusedError extends Error {
  constructor(
    readonly code: string,
    readonly sentence: Sentence,
  ) {
    super(sentence.en);
  }
}

/** The server doesn't answer. */
export class UnreachableError extends Error {}

async function ask<Name extends keyof Requests>(
  name: Name,
  message: Requests[Name]["message"] | null = null,
): Promise<Requests[Name]["answer"]> {
  const body = JSON.stringify(message ?? {});
  const request = { method: "POST", headers: { "Content-Type": "application/json" }, body };
  const response = await fetch(`/api/${name}`, request).catch(() => null);
  // A proxy between page and server answers 502 to 504 where the server itself is gone.
  if (response === null || (response.status >= 502 && response.status <= 504)) {
    useStudio.setState({ serverGone: true });
    throw new UnreachableError();
  }
  if (!response.ok) throw await refused(response);
  return (await response.json()) as Requests[Name]["answer"];
}

async function refused(response: Response): Promise<RefusedError> {
  const body = (await response.json().catch(() => null)) as { error?: ErrorAnswer } | null;
  const plain = `${response.status} ${response.statusText}`;
  return new RefusedError(body?.error?.code ?? plain, body?.error?.sentence ?? { en: plain, zh: plain });
}

export const capabilities = () => ask("capabilities");
export const profiles = () => ask("profiles");
export const compile = (blocks: Blocks) => ask("compile", blocks);
export const blocksToPython = (message: BlocksAndText) => ask("blocks-to-python", message);
export const pythonToBlocks = (message: BlocksAndText) => ask("python-to-blocks", message);
export const open = (text: string) => ask("open", { text });
export const projectText = (project: Project) => ask("save-text", project);
export const decompile = (image: string) => ask("decompile", { image });
export const projects = () => ask("projects/list");
export const saveProject = (name: string, project: Project) => ask("projects/write", { name, project });
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
export const ports = () => ask("ports");

/** The address of a WebSocket of the page's own server. */
export function socketUrl(path: string): string {
  return `${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}${path}`;
}

const EVERY_MS = 1500;

export function watchPresence(onBack: () => void): void {
  let asking = false;
  const ask = async () => {
    const back = await fetch("/api/capabilities", { method: "POST", cache: "no-store" }).then(
      (response) => response.ok,
      () => false,
    );
    if (!back) {
      setTimeout(() => void ask(), EVERY_MS);
      return;
    }
    asking = false;
    useStudio.setState({ serverGone: false });
    onBack();
  };
  useStudio.subscribe(({ serverGone }) => {
    if (!serverGone || asking) return;
    asking = true;
    setTimeout(() => void ask(), EVERY_MS);
  });
}

/** What the page needs from the server before anything can be drawn. */
export async function loadFigures(): Promise<void> {
  const name = useStudio.getState().profile;
  const [can, known] = await Promise.all([capabilities(), profiles()]);
  const profileFigures = known.find((profile) => profile.name === name) ?? null;
  useStudio.setState({ capabilities: can, profileFigures });
}
