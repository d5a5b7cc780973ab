/** What jsdom lacks of a browser, and how long tests wait for what a page shows. */

import { configure } from "@testing-library/dom";
import { vi } from "vitest";

// A second is too little on a busy machine: React Aria alone takes as long to load.
configure({ asyncUtilTimeout: 60_000 });

globalThis.matchMedia = (media) => Object.assign(new EventTarget(), { media, matches: false }) as MediaQueryList;
globalThis.Path2D = vi.fn() as never;
(globalThis.CSS as Partial<typeof CSS> | undefined) ??= { escape: (text: string) => text } as never;
