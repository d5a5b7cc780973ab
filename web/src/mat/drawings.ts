/** How often the stage is drawn, so that a slow browser is not busy with nothing else. */

/** Whoever draws twenty pictures a second and more needs no rest. */
const RESTLESS_MS = 50;
/** What took longer was no drawing: the computer slept, or the tab was hidden. */
const LONGEST_MS = 1000;

/** Drawings with the screen's pictures. Where one takes long until it is painted, the page rests as long before the next. */
export class Drawings {
  private waiting = false;
  private frame = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private begunAt = 0;
  private tookMs = 0;

  constructor(
    private readonly draw: () => void,
    private readonly now = () => performance.now(),
  ) {}

  /** Ask for a drawing; for one, however often it is asked. */
  request(): void {
    if (this.waiting) return;
    this.waiting = true;
    const restMs = this.tookMs > RESTLESS_MS ? this.begunAt + 2 * this.tookMs - this.now() : 0;
    const next = () => (this.frame = requestAnimationFrame(() => this.drawNow()));
    if (restMs > 0) this.timer = setTimeout(next, restMs);
    else next();
  }

  stop(): void {
    clearTimeout(this.timer);
    cancelAnimationFrame(this.frame);
  }

  private drawNow(): void {
    this.waiting = false;
    const begunAt = (this.begunAt = this.now());
    // A timer is due only when the picture is painted, which may take far longer than to say what is in it.
    setTimeout(() => (this.tookMs = Math.min(this.now() - begunAt, LONGEST_MS)));
    this.draw();
  }
}
