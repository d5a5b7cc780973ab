/** A service that is Python in workers of this browser. */

import { RefusedError, type Service, type Stream, type StreamListeners, type StreamName, UnreachableError } from "../api/service";
import type { ErrorAnswer, Requests } from "../generated/messages";
import { useStudio } from "../state/studio";
import { FirstWorld } from "./firstWorld";
import { Opening } from "./opening";
import type { Places } from "./protocol";
import { RestartingWorker } from "./restartingWorker";

/** Files answer them, as the answers never change: the page can be drawn before Python runs. */
const STATIC: readonly (keyof Requests)[] = ["capabilities", "profiles", "examples"];
/** They are asked for first. */
const FIRST: readonly (keyof Requests)[] = ["capabilities", "profiles"];
/** They may take many seconds, so a second worker answers them, as it does trials: no picture and no other request waits. */
const LONG: readonly (keyof Requests)[] = ["missions/check"];
/** Python waits no longer for a stage that isn't drawn, as in a tab that nobody sees. */
const LATEST_START_MS = 3000;
const MOST_UNANSWERED = 10;
const MOST_UNANSWERED_BY_LONG = 60;

export class WorkerService implements Service {
  private readonly worker: RestartingWorker;
  private hasAsked = false;
  private second: RestartingWorker | null = null;
  private readonly files = new Map<string, Promise<unknown>>();
  /** What a first visit finds; null where nobody asked for it. */
  private opening: Opening | null = null;
  private opened: Promise<Opening | null> | null = null;
  /** Let Python start. */
  private begin: () => void = () => undefined;

  /**
   * @param makeWorker makes a worker that runs `worker.ts`.
   * @param places the addresses of what it loads.
   * @param fileUrl the address of a file of the site.
   * @param isFirstVisit the page will ask for what a first visit finds. It is loaded at once, and Python, which would
   *   take a processor from the page, starts when the page has drawn it, or asks for something else.
   */
  constructor(
    private readonly makeWorker: () => Worker,
    private readonly places: Places,
    private readonly fileUrl: (name: string) => string,
    isFirstVisit = false,
  ) {
    useStudio.setState({ service: "starting" });
    const due = isFirstVisit ? new Promise<void>((resolve) => (this.begin = resolve)) : Promise.resolve();
    this.worker = new RestartingWorker(makeWorker, places, MOST_UNANSWERED, (service) => useStudio.setState({ service }), due);
    if (!isFirstVisit) return;
    setTimeout(this.begin, LATEST_START_MS);
    void this.loadOpening();
    for (const name of FIRST) void this.file(`start/${name}.json`).catch(() => undefined);
  }

  /** What a first visit finds; null where a file is missing. */
  private loadOpening(): Promise<Opening | null> {
    return (this.opened ??= Opening.load(this.fileUrl).catch(() => null));
  }

  async ask<Name extends keyof Requests>(name: Name, message: Requests[Name]["message"] | null): Promise<Requests[Name]["answer"]> {
    if (STATIC.includes(name)) return (await this.file(`start/${name}.json`)) as Requests[Name]["answer"];
    if (name === "opening") {
      // Where the file is missing, Python answers.
      this.opening = await this.loadOpening();
      if (this.opening) return this.opening.project;
    }
    const compiled = name === "compile" ? this.opening?.compiled(message as Requests["compile"]["message"]) : null;
    if (compiled) return compiled;
    this.begin();
    const worker = LONG.includes(name) ? this.secondWorker() : this.worker;
    const text = await worker.ask(name, JSON.stringify(message ?? {}));
    const { answer, error } = JSON.parse(text) as { answer?: Requests[Name]["answer"]; error?: ErrorAnswer };
    if (error) throw new RefusedError(error.code, error.sentence);
    if (name === "projects/write") this.askToKeep();
    return answer!;
  }

  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream {
    if (name === "trials") return this.secondWorker().openStream(name, session, listeners);
    const open = (each: StreamListeners) => this.worker.openStream(name, session, each);
    const isFirst = name === "world" && this.opening && useStudio.getState().service === "starting";
    if (isFirst) return new FirstWorld(this.opening!, session, listeners, open, this.begin);
    this.begin();
    return open(listeners);
  }

  /** Ask the browser once not to clear what this site has stored when it needs room. */
  private askToKeep(): void {
    if (this.hasAsked) return;
    this.hasAsked = true;
    const storage = (navigator as { storage?: Partial<StorageManager> }).storage;
    void storage?.persist?.().catch(() => false);
  }

  private secondWorker(): RestartingWorker {
    this.second ??= new RestartingWorker(this.makeWorker, this.places, MOST_UNANSWERED_BY_LONG, () => undefined, Promise.resolve());
    return this.second;
  }

  /** A file of the site, as JSON. */
  private file(path: string): Promise<unknown> {
    const known = this.files.get(path);
    if (known) return known;
    const fetched = fetch(this.fileUrl(path))
      .then((response) => (response.ok ? response.json() : Promise.reject(new UnreachableError())))
      .catch(() => {
        this.files.delete(path);
        throw new UnreachableError();
      });
    this.files.set(path, fetched);
    return fetched;
  }
}
