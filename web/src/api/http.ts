/** The server's answers, typed. A server that isn't there is told to the whole page. */

import { useStudio } from "../app/store";
import type {
  Compiled,
  Example,
  Formats,
  OpenedProject,
  Port,
  Profile,
  Project,
  SavedProject,
  Sentence,
  Version,
  WorkspaceState,
} from "./types";

/** What the server refused, in its own words. */
export class RefusedError extends Error {
  constructor(
    readonly code: string,
    readonly sentence: Sentence,
  ) {
    super(sentence.en);
  }
}

/** Nobody answers. */
export class GoneError extends Error {}

async function ask(path: string, method = "GET", body?: unknown): Promise<Response> {
  const request: RequestInit =
    body === undefined
      ? { method }
      : { method, headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  const response = await fetch(path, request).catch(() => null);
  // A proxy between page and server answers 502 to 504 where the server itself is gone.
  if (response === null || (response.status >= 502 && response.status <= 504)) {
    useStudio.setState({ serverGone: true });
    throw new GoneError();
  }
  if (!response.ok) throw await refused(response);
  return response;
}

async function refused(response: Response): Promise<RefusedError> {
  const body = (await response.json().catch(() => null)) as { error?: { code: string; message: Sentence } } | null;
  const plain = `${response.status} ${response.statusText}`;
  return new RefusedError(body?.error?.code ?? plain, body?.error?.message ?? { en: plain, zh: plain });
}

async function json<T>(path: string, method?: string, body?: unknown): Promise<T> {
  const response = await ask(path, method, body);
  return (response.status === 204 ? undefined : await response.json()) as T;
}

const named = (name: string) => `/api/projects/${encodeURIComponent(name)}`;

export const formats = () => json<Formats>("/api/formats");
export const profile = (name: string) => json<Profile>(`/api/profile?name=${encodeURIComponent(name)}`);
export const compile = (blocks: { leader: WorkspaceState; followers: WorkspaceState | null; profile: string }) =>
  json<Compiled>("/api/compile", "POST", blocks);
export const open = (text: string) => json<OpenedProject>("/api/open", "POST", { text });
export const projectText = (project: Project) => json<{ text: string }>("/api/project", "POST", project);
export const decompile = (image: string) => json<OpenedProject>("/api/decompile", "POST", { image });
export const projects = () => json<SavedProject[]>("/api/projects");
export const saveProject = (name: string, project: Project) =>
  json<{ version: number }>(named(name), "PUT", project);
export const savedProject = (name: string, version?: number) =>
  json<OpenedProject>(version === undefined ? named(name) : `${named(name)}?version=${version}`);
export const versions = (name: string) => json<Version[]>(`${named(name)}/versions`);
export const deleteProject = (name: string) => json<unknown>(named(name), "DELETE");
export const examples = () => json<Example[]>("/api/examples");
export const example = (id: string) => json<OpenedProject>(`/api/examples/${encodeURIComponent(id)}`);
export const ports = () => json<Port[]>("/api/ports");

/** The address of a WebSocket of the page's own server. */
export function socketUrl(path: string): string {
  return `${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}${path}`;
}
