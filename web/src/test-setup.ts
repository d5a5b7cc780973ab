/** What jsdom lacks of a browser. */

import { vi } from "vitest";

globalThis.matchMedia = (media) => Object.assign(new EventTarget(), { media, matches: false }) as MediaQueryList;
globalThis.Path2D = vi.fn() as never;
(globalThis.CSS as Partial<typeof CSS> | undefined) ??= { escape: (text: string) => text } as never;
