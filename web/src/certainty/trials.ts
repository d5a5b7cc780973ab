/** Behind the page the program runs on other seeds, and two runs are compared: the stream `trials`, and what it said. */

import { create } from "zustand";
import { LastingStream } from "../api/connection";
import { service } from "../api/service";
import { decodePicture, type Picture } from "../api/world";
import type { Difference, Failure, Luck, MissionChoice, Refused, TrialAnswer, TrialMessage } from "../generated/messages";
import { type Run, runNow } from "../mat/run";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { documentOf, useDraft } from "../missions/draft";
import { useStudio } from "../state/studio";
import { endAll, listen } from "../ui/areas";

interface Trials {
  luck: Luck | null;
  /** What went wrong in the runs that failed, by their seeds, as far as it was asked. */
  failures: ReadonlyMap<number, Failure>;
  /** Where the two runs part; null while that is looked for, or nothing is compared. */
  difference: Difference | null;
  /** The two runs that are compared. */
  runs: readonly [Run, Run] | null;
  /** How far both are simulated. */
  comparedMs: number;
  /** The time that is shown of both, and their pictures. */
  shownMs: number;
  pictures: readonly (Picture | undefined)[];
  /** Why the last wish was refused. */
  problem: Refused | null;
  /** The run before the last change of the program. */
  before: Run | null;
}

const UNCOMPARED = { difference: null, runs: null, comparedMs: 0, shownMs: 0, pictures: [] };
const NOTHING = { luck: null, failures: new Map<number, Failure>(), problem: null };

export const useTrials = create<Trials>(() => ({ ...NOTHING, ...UNCOMPARED, before: null }));

/** Who edits gets its words first; the program is tried again when the hands rest. */
const REST_MS = 1500;
const RUNS = 200;

/** What is tried: the mission that is played, or the one that is written, on the project's mat. */
function triedMission(): MissionChoice | null {
  const { mission, mat } = useStudio.getState();
  const { draft } = useDraft.getState();
  return mission ?? (draft && { document: documentOf(draft, mat) });
}

export class TrialStream {
  private stream: LastingStream<TrialAnswer> | null = null;
  private tried: TrialMessage | null = null;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private run: Run | null = null;

  /** Follow the program and the world from now on; returns what ends this. */
  watch(): () => void {
    // Whoever touches the blocks is about to change them.
    const touch = ({ target }: Event) => target instanceof Element && target.closest(".injectionDiv") && this.rest();
    return endAll(
      listen(window, ["pointerdown", "keydown"], touch, true),
      useStudio.subscribe((now, before) => {
        if (now.compiled?.image !== before.compiled?.image || now.mission !== before.mission || now.profile !== before.profile) this.change();
        else if (now.leader !== before.leader || now.followers !== before.followers) this.rest();
      }),
      useDraft.subscribe(() => this.change()),
      useMat.subscribe(({ state }, before) => {
        if (state?.playing && !before.state?.playing) this.play();
      }),
      () => this.close(),
    );
  }

  /** Begin to try the program, where there is a mission and nothing was tried yet. */
  begin(): void {
    const [mission, image] = [triedMission(), useStudio.getState().compiled?.image];
    if (!mission || !image || this.tried) return;
    this.tried = { do: "try", mission, image, runs: RUNS };
    useTrials.setState(NOTHING);
    this.send(this.tried);
  }

  compare(one: Run, other: Run, untilMs: number): void {
    useTrials.setState({ ...UNCOMPARED, runs: [one, other], problem: null });
    this.send({ do: "compare", one: { do: "set", ...one }, other: { do: "set", ...other }, until_ms: untilMs });
  }

  /** Show both runs at a time. */
  show(tMs: number): void {
    useTrials.setState({ shownMs: tMs });
    this.send({ do: "show", t_ms: Math.max(0, Math.round(tMs)) });
  }

  endComparison(): void {
    useTrials.setState(UNCOMPARED);
  }

  /** The program has changed: what was tried means nothing any more. */
  private change(): void {
    this.endWait();
    const { compiled } = useStudio.getState();
    if (this.run && compiled?.image && this.run.image !== compiled.image) {
      useTrials.setState({ before: this.run });
      this.run = null;
    }
    if (this.tried) this.close();
    useTrials.setState(NOTHING);
    if (useMat.getState().state?.playing) this.wait(() => this.play());
  }

  /** Blocks change: their words come before what is still tried, which begins anew where the program stays the same. */
  private rest(): void {
    const { luck } = useTrials.getState();
    if (!this.tried || (luck && luck.tried === luck.of)) return;
    this.close();
    this.wait(() => this.begin());
  }

  /** Do something when the hands rest. */
  private wait(job: () => void): void {
    this.endWait();
    this.timer = setTimeout(() => {
      this.timer = undefined;
      job();
    }, REST_MS);
  }

  private play(): void {
    const run = runNow();
    this.run = run.image ? run : null;
    // An edit lets the cars begin again, while the hands don't rest yet.
    if (this.timer !== undefined) return;
    const { capabilities, compiled } = useStudio.getState();
    // A class shares one computer: whoever wants it there asks for it. Without blocks there is nothing to try.
    if (!capabilities?.classroom && compiled && compiled.states + compiled.follower_words > 0) this.begin();
  }

  private endWait(): void {
    clearTimeout(this.timer);
    this.timer = undefined;
  }

  private close(): void {
    this.endWait();
    this.stream?.close();
    this.stream = this.tried = null;
  }

  /** Send a message, as soon as the stream is open. */
  send(message: TrialMessage): void {
    if (this.stream?.send(message)) return;
    this.waiting.push(message);
    if (this.stream) return;
    this.stream = new LastingStream((listeners) => service.openStream("trials", session.name, listeners), {
      onOpen: () => this.waiting.splice(0).forEach((each) => this.stream?.send(each)),
      onAnswer: (answer) => this.receive(answer),
      onBytes: (bytes) => {
        const picture = decodePicture(bytes);
        if (picture) useTrials.setState(({ pictures: [one, other] }) => ({ pictures: picture.frame ? [one, picture] : [picture, other] }));
      },
      // Its work is lost: it begins anew.
      onClose: () => this.tried && this.waiting.unshift(this.tried),
    });
    this.stream.reopen();
  }

  private readonly waiting: TrialMessage[] = [];

  private receive(answer: TrialAnswer): void {
    if (answer.is === "luck") useTrials.setState({ luck: answer });
    if (answer.is === "failure") useTrials.setState(({ failures }) => ({ failures: new Map(failures).set(answer.seed, answer) }));
    if (answer.is === "difference") {
      useTrials.setState({ difference: answer });
      this.show(answer.t_ms);
    }
    if (answer.is === "compared") useTrials.setState({ comparedMs: answer.t_ms });
    if (answer.is === "error") useTrials.setState({ problem: answer, runs: null });
  }
}

/** The trials of the page. */
export const trials = new TrialStream();

/** Play the run of a seed from shortly before a moment, with the cars ringed that it is about. */
export function playFrom(seed: number, tMs: number, cars: readonly number[]): void {
  useMat.setState({ seed });
  session.send({ do: "reset", seed, until_ms: Math.max(0, tMs - BEFORE_MS) });
  session.play();
  useMat.setState({ chosen: cars.length ? { car: cars[0]! } : null, told: cars });
}

const BEFORE_MS = 3000;
