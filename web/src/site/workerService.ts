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
/** They may take many seconds, so a second worker answers them: no picture and no other request waits. */
const LONG: readonly (keyof Requests)[] = ["missions/check"];
const MOST_UNANSWERED = 10;
const MOST_UNANSWERED_BY_LONG = 60;

export class WorkerService implements Service {
  private readonly worker: RestartingWorker;
  private hasAsked = false;
  private second: RestartingWorker | null = null;
  private readonly files = new Map<string, Promise<unknown>>();
  /** What a first visit finds; null where nobody asked for it. */
  private opening: Opening | null = null;

  /**
   * @param makeWorker makes a worker that runs `worker.ts`.
   * @param places the addresses of what it loads.
   * @param fileUrl the address of a file of the site.
   */
  constructor(
    private readonly makeWorker: () => Worker,
    private readonly places: Places,
    private readonly fileUrl: (name: string) => string,
  ) {
    useStudio.setState({ service: "starting" });
    this.worker = new RestartingWorker(makeWorker, places, MOST_UNANSWERED, (service) => useStudio.setState({ service }));
  }

  async ask<Name extends keyof Requests>(name: Name, message: Requests[Name]["message"] | null): Promise<Requests[Name]["answer"]> {
    if (STATIC.includes(name)) return (await this.file(`start/${name}.json`)) as Requests[Name]["answer"];
    if (name === "opening") {
      // Where the file is missing, Python answers.
      this.opening ??= await Opening.load(this.fileUrl).catch(() => null);
      if (this.opening) return this.opening.project;
    }
    const compiled = name === "compile" ? this.opening?.compiled(message as Requests["compile"]["message"]) : null;
    if (compiled) return compiled;
    const worker = LONG.includes(name) ? this.secondWorker() : this.worker;
    const text = await worker.ask(name, JSON.stringify(message ?? {}));
    const { answer, error } = JSON.parse(text) as { answer?: Requests[Name]["answer"]; error?: ErrorAnswer };
    if (error) throw new RefusedError(error.code, error.sentence);
    if (name === "projects/write") this.askToKeep();
    return answer!;
  }

  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream {
    const open = (each: StreamListeners) => this.worker.openStream(name, session, each);
    const isFirst = name === "world" && this.opening && useStudio.getState().service === "starting";
    return isFirst ? new FirstWorld(this.opening!, session, listeners, open) : open(listeners);
  }

  /** Ask the browser once not to clear what this site has stored when it needs room. */
  private askToKeep(): void {
    if (this.hasAsked) return;
    this.hasAsked = true;
    const storage = (navigator as { storage?: Partial<StorageManager> }).storage;
    void storage?.persist?.().catch(() => false);
  }

  private secondWorker(): RestartingWorker {
    this.second ??= new RestartingWorker(this.makeWorker, this.places, MOST_UNANSWERED_BY_LONG, () => undefined);
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
