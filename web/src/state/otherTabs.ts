/**
 * What the other open tabs of this browser hold. A new page asks once, by a BroadcastChannel; each page that is open
 * answers. Locks would do the same by HTTPS alone, and most classes use plain HTTP.
 */

import { keep } from "./storage";

/** The key of this tab's place, in storage that survives a reload and is copied with the tab. */
export const PLACE_KEY = "motorcade.place";

/** The place of a tab's work, the name of its world, and the blocks that were copied last. */
interface Held {
  place: string;
  world: string;
  copied: object | null;
}

type News = { is: "ask" } | ({ is: "held" } & Held) | { is: "copied"; copied: object };

/** What this page holds. */
export const own: Held = { place: "", world: "", copied: null };

/**
 * Most answer within a few milliseconds; what a page holds that answers later is still safe, since pages notice who takes
 * it. A page with the storage of a tab that wasn't left is most likely a copy of an open tab, and waits longer.
 */
const ANSWER_MS = 300;
const ANSWER_OF_ORIGINAL_MS = 1500;
/** Set while no page of this tab is open: the next one goes on where that one was. */
const LEFT_KEY = "motorcade.left";

/** A channel between the pages of this browser; null where the browser forbids it, as it may where it forbids storage. */
export function openChannel(name: string, receive: (message: never) => void): BroadcastChannel | null {
  try {
    const channel = new BroadcastChannel(name);
    channel.onmessage = ({ data }: MessageEvent) => receive(data as never);
    return channel;
  } catch {
    return null;
  }
}

const taken = new Set<string>();
let channel: BroadcastChannel | null = null;
let answered: Promise<unknown> = Promise.resolve();

function receive(news: News): void {
  if (news.is === "ask") channel?.postMessage({ is: "held", ...own } satisfies News);
  if (news.is === "held") taken.add(news.place).add(news.world);
  if (news.is !== "ask" && news.copied) own.copied = news.copied;
}

/** Ask the other tabs, and answer them from now on. To be called once. */
export function startOtherTabs(): void {
  const goesOn = sessionStorage.getItem(LEFT_KEY) !== null;
  const isCopy = !goesOn && sessionStorage.getItem(PLACE_KEY) !== null;
  window.addEventListener("pagehide", () => keep("sessionStorage", LEFT_KEY, "1"));
  window.addEventListener("pageshow", () => sessionStorage.removeItem(LEFT_KEY));
  channel = openChannel("motorcade.tabs", receive);
  channel?.postMessage({ is: "ask" } satisfies News);
  const patienceMs = isCopy ? ANSWER_OF_ORIGINAL_MS : ANSWER_MS;
  answered = new Promise((resolve) => setTimeout(resolve, goesOn ? 0 : patienceMs));
}

/** The places and worlds that other tabs hold, once they have had time to answer. */
export async function heldByOthers(): Promise<ReadonlySet<string>> {
  await answered;
  return taken;
}

/** Let all tabs paste these blocks. */
export function shareCopied(copied: object): void {
  own.copied = copied;
  channel?.postMessage({ is: "copied", copied } satisfies News);
}
