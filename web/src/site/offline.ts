/**
 * The site without a network, and its updates.
 *
 * The service worker stores the files of a build when the page has started. A newer build waits until no page has work:
 * nothing unsaved, nothing that plays, and nobody at the page; or until the user asks for it.
 */

import type { ToPage, ToServiceWorker } from "./messages";

const LOOK_EVERY_MS = 30_000;
const UPDATE_EVERY_MS = 3_600_000;
// So long after the last key or click nobody is at the page.
const AWAY_MS = 60_000;

export interface Options {
  /** Whether the page has work that a reload would lose or disturb. */
  isBusy: () => boolean;
  /** A newer build is there and waits; `takeOver` lets it begin, unless another page has work. */
  onUpdate: (takeOver: () => void) => void;
  /** The newer build can't take over: another page of the studio has work. */
  onRefused: () => void;
}

/** Store the site for use without a network, where the browser can; to be called when the page has started. */
export async function startOffline({ isBusy, onUpdate, onRefused }: Options): Promise<void> {
  // Not there over plain HTTP from another computer, and in some private windows.
  if (!("serviceWorker" in navigator)) return;
  const workers = navigator.serviceWorker;
  let lastInput = Date.now();
  for (const kind of ["pointerdown", "keydown", "wheel"]) addEventListener(kind, () => (lastInput = Date.now()), { passive: true });
  const isIdle = () => !isBusy() && (document.hidden || Date.now() - lastInput > AWAY_MS);

  workers.addEventListener("message", (event: MessageEvent<ToPage>) => {
    if (event.data === "is-idle") event.ports[0]?.postMessage(isIdle());
    else onRefused();
  });
  // A page that began without a service worker has loaded this build's files itself.
  if (workers.controller) workers.addEventListener("controllerchange", () => location.reload(), { once: true });

  const registration = await workers.register(new URL("sw.js", document.baseURI), { updateViaCache: "none" });
  const takeOver = () => registration.waiting?.postMessage("take-over" satisfies ToServiceWorker);
  let told: ServiceWorker | null = null;
  const look = () => {
    if (registration.waiting === null || workers.controller === null) return;
    if (told !== registration.waiting) onUpdate(takeOver);
    told = registration.waiting;
    if (isIdle()) takeOver();
  };
  registration.addEventListener("updatefound", () => registration.installing?.addEventListener("statechange", look));
  document.addEventListener("visibilitychange", look);
  setInterval(look, LOOK_EVERY_MS);
  setInterval(() => void registration.update().catch(() => undefined), UPDATE_EVERY_MS);
  look();
}
