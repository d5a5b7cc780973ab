/**
 * The service worker of the site: it stores all files of one build, and answers from them, with or without a network.
 *
 * A new build waits beside the one in use. It takes over when no page has work that a reload would lose.
 */

/// <reference lib="webworker" />

import { addPlugins, precacheAndRoute, type PrecacheEntry } from "workbox-precaching";

// Types alone: this file must become one script, without imports.
import type { FromServiceWorker, ToServiceWorker } from "./protocol";

declare const self: ServiceWorkerGlobalScope & { __WB_MANIFEST: PrecacheEntry[] };

const ANSWER_MS = 2000;

/** The files that could not be stored the last time. */
const FAILED = "failed";

// The browser's cache has what the page has just loaded: the server is asked only whether that is still the same. A file
// whose hash is wrong is loaded as a whole the next time.
addPlugins([
  {
    requestWillFetch: async ({ request }) => {
      const failed = await caches.match(request.url, { cacheName: FAILED });
      return new Request(request, { cache: failed ? "reload" : "no-cache" });
    },
    fetchDidFail: async ({ request }) => (await caches.open(FAILED)).put(request.url, new Response()),
  },
]);
// `motorcade site` writes the list of files here.
precacheAndRoute(self.__WB_MANIFEST, { cleanURLs: false });

// The page of the first visit, too, is answered without a network from now on.
self.addEventListener("activate", (event) => event.waitUntil(Promise.all([caches.delete(FAILED), self.clients.claim()])));

self.addEventListener("message", (event) => {
  const message = event.data as ToServiceWorker | null;
  if (message) event.waitUntil(takeOver(event.source as WindowClient | null));
});

/** Take over from the build in use, unless a page other than the one that asks has work. */
async function takeOver(asking: WindowClient | null): Promise<void> {
  const clients = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
  // The documentation may be below the site's address.
  const isPage = (url: string) => ["", "index.html"].some((name) => url.split(/[?#]/)[0] === self.registration.scope + name);
  const others = clients.filter(({ id, url }) => id !== asking?.id && isPage(url));
  const idle = await Promise.all(others.map(isIdle));
  if (idle.every(Boolean)) await self.skipWaiting();
  else asking?.postMessage("others-have-work" satisfies FromServiceWorker);
}

/** Whether a page says that it has no work; a page that doesn't answer may have some. */
function isIdle(page: Client): Promise<boolean> {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = ({ data }) => resolve(data === true);
    page.postMessage("is-idle" satisfies FromServiceWorker, [port2]);
    setTimeout(() => resolve(false), ANSWER_MS);
  });
}
