/**
 * The site without a network, and its updates.
 *
 * The service worker stores the files of a build when the page has started. A newer build waits until no page has work:
 * nothing unsaved, nothing that plays, and nobody at the page; or until the user asks for it.
 */

import { say } from "../i18n";
import { useMat } from "../mat/store";
import { notify, useDialogs } from "../state/dialogs";
import { useStudio } from "../state/studio";
import type { FromServiceWorker, ToServiceWorker } from "./protocol";

const LOOK_EVERY_MS = 30_000;
const UPDATE_EVERY_MS = 3_600_000;
// So long after the last key or click nobody is at the page.
const AWAY_MS = 60_000;

/** Whether a reload would lose or disturb something. */
function isBusy(): boolean {
  return useStudio.getState().unsaved || useMat.getState().state?.playing === true || useDialogs.getState().open !== null;
}

/** Wait until Python runs, or can't be started. */
function started(): Promise<void> {
  const isOver = () => useStudio.getState().service !== "starting";
  if (isOver()) return Promise.resolve();
  return new Promise((resolve) => {
    const stop = useStudio.subscribe(() => {
      if (!isOver()) return;
      stop();
      resolve();
    });
  });
}

/** Store the site for use without a network, where the browser can; to be called when the page has started. */
export async function startOffline(): Promise<void> {
  // Not there over plain HTTP from another computer, and in some private windows.
  if (!("serviceWorker" in navigator)) return;
  const workers = navigator.serviceWorker;
  let lastInput = Date.now();
  let asked = false;
  for (const kind of ["pointerdown", "keydown", "wheel"]) addEventListener(kind, () => (lastInput = Date.now()), { passive: true });
  const isIdle = () => !isBusy() && (document.hidden || Date.now() - lastInput > AWAY_MS);

  workers.addEventListener("message", (event: MessageEvent<FromServiceWorker>) => {
    if (event.data === "is-idle") event.ports[0]?.postMessage(isIdle());
    else if (asked) notify(say("site.otherTabs"), "warning");
    asked &&= event.data === "is-idle";
  });
  // The first service worker has the build that this page began with; the next one has another.
  let isFirst = workers.controller === null;
  workers.addEventListener("controllerchange", () => {
    if (!isFirst) location.reload();
    isFirst = false;
  });

  // Storing 19 MB would delay Python.
  await started();
  const registration = await workers.register(new URL("sw.js", document.baseURI), { updateViaCache: "none" });
  const takeOver = () => registration.waiting?.postMessage("take-over" satisfies ToServiceWorker);
  let told: ServiceWorker | null = null;
  const look = () => {
    if (registration.waiting === null || workers.controller === null) return;
    if (told !== registration.waiting) {
      const run = () => {
        asked = true;
        takeOver();
      };
      notify(say("site.update"), "info", { label: say("site.useUpdate"), run });
    }
    told = registration.waiting;
    if (isIdle()) takeOver();
  };
  registration.addEventListener("updatefound", () => registration.installing?.addEventListener("statechange", look));
  // Not when the page becomes hidden: it may be leaving, and the next one would begin with the old build.
  setInterval(look, LOOK_EVERY_MS);
  setInterval(() => void registration.update().catch(() => undefined), UPDATE_EVERY_MS);
  look();
}
