/**
 * Keep the work in the places that are for it: this browser's storage, the library, a class's draft, the windows of a pair.
 *
 * A place says which changes concern it, and writes what the page holds. All else is the same for each place, and is done
 * by its keeper. Changes are collected, and the newest work is written. One write is under way at a time; what changes
 * meanwhile is written after it, so a late answer says nothing about newer work. Where nothing answers, the keeper tries
 * again; what a place refuses stays due until the next change, unless the place has brought it elsewhere. A page that is
 * hidden or left writes at once: no browser says whether it comes back.
 */

import { RefusedError, UnreachableError } from "../api/service";
import { type Studio, useStudio } from "../state/studio";
import { endAll, listen } from "../ui/areas";

export interface Place {
  /** Whether a change of the page changes what the place holds. */
  concerns(now: Studio, before: Studio): boolean;
  /**
   * Write what the page holds. Throws UnreachableError where nothing answers, and RefusedError where it can't be kept here
   * and nowhere else. A place of this browser writes at once, and returns nothing.
   */
  write(): Promise<void> | undefined;
}

export class Keeper {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private writing: Promise<void> | null = null;
  private isDue = false;
  private isRefused = false;

  /**
   * @param place where the work is kept.
   * @param afterMs changes are collected for so long.
   * @param againMs where nothing answers, the place is written again after so long.
   */
  constructor(
    private readonly place: Place,
    private readonly afterMs: number,
    private readonly againMs: number,
  ) {}

  /** Whether the place has all work, and none is on its way. */
  get isKept(): boolean {
    return !this.isDue && !this.isRefused && this.writing === null;
  }

  /** Keep each change from now on; returns a function that ends this. */
  start(): () => void {
    const leave = () => void this.keepNow();
    return endAll(
      useStudio.subscribe((now, before) => {
        if (this.place.concerns(now, before)) this.note();
      }),
      listen(window, ["pagehide"], leave),
      listen(document, ["visibilitychange"], () => document.hidden && leave()),
      () => clearTimeout(this.timer),
    );
  }

  /** Something has changed that the place doesn't have. */
  note(): void {
    this.isDue = true;
    if (!this.writing) this.wait(this.afterMs);
  }

  private wait(ms: number): void {
    this.timer ??= setTimeout(() => void this.keepNow(), document.hidden ? 0 : ms);
  }

  /** Write what is due, at once; resolved when that is done. */
  keepNow(): Promise<void> {
    clearTimeout(this.timer);
    this.timer = undefined;
    if (this.isDue && !this.writing) {
      this.isDue = this.isRefused = false;
      const written = this.place.write();
      if (written) this.writing = this.finish(written);
    }
    return this.writing ?? Promise.resolve();
  }

  private async finish(written: Promise<void>): Promise<void> {
    let waitMs = this.afterMs;
    try {
      await written;
    } catch (problem) {
      if (problem instanceof UnreachableError) {
        this.isDue = true;
        waitMs = this.againMs;
      } else if (problem instanceof RefusedError) this.isRefused = true;
      else throw problem;
    } finally {
      this.writing = null;
    }
    if (this.isDue) this.wait(waitMs);
  }
}
