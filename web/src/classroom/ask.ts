/** Requests and streams between the pages of a class and its server. */

import type { TeacherRequests, PupilRequests } from "../generated/classroom";
import { LastingStream, openSocket, post as postTo } from "../api/connection";
import { RefusedError, UnreachableError } from "../api/service";
import { endAll, listen } from "../ui/areas";
import type { WorkFile } from "./workFiles";

/** The page that gives a session, by the error that asks for one. */
const SIGN_IN_PAGES: Record<string, string> = { "class-session-needed": "/join", "teacher-session-needed": "/teacher" };

/** What a request to the class's server throws. */
export type ClassError = RefusedError | UnreachableError;
export const isClassError = (problem: unknown): problem is ClassError => problem instanceof RefusedError || problem instanceof UnreachableError;

async function post(path: string, message: unknown): Promise<unknown> {
  try {
    return await postTo(path, message);
  } catch (problem) {
    if (problem instanceof RefusedError) openSignIn(problem.code);
    throw problem;
  }
}

function openSignIn(code: string): void {
  const page = SIGN_IN_PAGES[code];
  if (page && location.pathname !== page) location.assign(page);
}

type Ask<Requests extends Record<keyof Requests, { message: unknown; answer: unknown }>> = <Name extends keyof Requests>(
  name: Name,
  message?: Requests[Name]["message"],
) => Promise<Requests[Name]["answer"]>;

/** A request of a pupil's page. Throws RefusedError or UnreachableError. */
export const askClass = ((name: string, message) => post(`/api/class/${name}`, message)) as Ask<PupilRequests>;

const FLOOD_TRIES = 20;
const FLOOD_WAIT_MS = 400;

/**
 * A request of a newcomer's page. Throws RefusedError or UnreachableError.
 *
 * Newcomers behind one router share the rate of its address: where another tablet there floods the server, they ask again.
 */
export const askToJoin: Ask<PupilRequests> = async (name, message) => {
  for (let tries = 1; ; tries++) {
    try {
      return await askClass(name, message);
    } catch (problem) {
      if (!(problem instanceof RefusedError && problem.code === "requests-too-fast") || tries === FLOOD_TRIES) throw problem;
      await new Promise((resolve) => setTimeout(resolve, FLOOD_WAIT_MS * (0.5 + Math.random())));
    }
  }
};

/** A request of the teacher's page. Throws RefusedError or UnreachableError. */
export const askTeacher = ((name: string, message) => post(`/api/teacher/${name}`, message)) as Ask<TeacherRequests>;

/** What is checked, as `ReportOrder` in motorcade/classroom/folder.py describes it. */
export type ReportOrder = ({ mission: string } | { text: string }) & { files?: WorkFile[] };

/** The page of a report. Throws RefusedError or UnreachableError. */
export async function askReport(order: ReportOrder, language: string): Promise<string> {
  return (await post(`/api/teacher/report.html?language=${language}`, order)) as string;
}

interface Told {
  is: string;
  code?: string;
}

interface ClassListeners<Answer extends Told> {
  onAnswer: (answer: Answer) => void;
  onBytes?: (bytes: ArrayBuffer) => void;
  onLink?: (open: boolean) => void;
}

/** A connection that was silent for so long may be lost without a sign where the device slept or changed its network. */
const SILENT_MS = 6000;

/** A WebSocket of the class's server, opened again whenever it is lost; `close` ends it. */
export class ClassStream<Answer extends Told> {
  private readonly stream: LastingStream<Answer>;
  private heardAt = Date.now();
  readonly close: () => void;

  constructor(
    path: string,
    private readonly listeners: ClassListeners<Answer>,
  ) {
    this.stream = new LastingStream<Answer>((stream) => openSocket(path, stream), {
      onAnswer: (answer) => this.receive(answer),
      onBytes: (bytes) => {
        this.hear();
        listeners.onBytes?.(bytes);
      },
      onClose: () => listeners.onLink?.(false),
    });
    this.stream.reopen();
    // The device comes back: a silent connection may be one that is lost.
    const wake = () => {
      if (!document.hidden && Date.now() - this.heardAt >= SILENT_MS) this.stream.reopen();
    };
    this.close = endAll(listen(window, ["online"], wake), listen(document, ["visibilitychange"], wake), () => this.stream.close());
  }

  private hear(): void {
    this.heardAt = Date.now();
    this.listeners.onLink?.(true);
  }

  private receive(answer: Answer): void {
    this.hear();
    // Another page has the world now: who took it back at once would take turns with it.
    if (answer.is === "goodbye" || answer.code === "taken-over") this.close();
    if (answer.is === "error") openSignIn(answer.code ?? "");
    this.listeners.onAnswer(answer);
  }

  send(message: object): void {
    this.stream.send(message);
  }
}
