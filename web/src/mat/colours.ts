/** The mat's colours: of the theme, from the page's style sheets, and of each word, as in pictures and films of a run. */

import type { CompiledWord } from "../api/types";
import { Flag, NO_INDEX } from "../api/world";
import { endAll, listen } from "../ui/areas";

const FOLLOWERS = [0x1f77b4, 0xff7f0e, 0x2ca02c, 0x9467bd, 0x17becf, 0xbcbd22, 0x8c564b, 0xe377c2];
const LEADERS = [0xd62728, 0xf0797a, 0x9c1a1b, 0xf9b3b3];
const NOTHING = 0xc4c4c4;
/** Of a word that the program does not have. */
export const UNKNOWN = 0x6e6e6e;
const PALER = 0.55;
export const LEDS = [0xffd60a, 0x00e5ff, 0xb8ff3d, 0xff5cd6];

export interface WordColours {
  /** By place in the image. */
  strong: readonly number[];
  pale: readonly number[];
  /** By the word's bits. */
  byWord: ReadonlyMap<number, number>;
}

function paler(colour: number): number {
  const channel = (shift: number) => {
    const value = (colour >> shift) & 255;
    return Math.round(value + (255 - value) * PALER) << shift;
  };
  return channel(16) | channel(8) | channel(0);
}

export function colourWords(words: readonly CompiledWord[]): WordColours {
  const byWord = new Map<number, number>();
  const give = (part: CompiledWord["part"], shades: readonly number[]) => {
    let next = 0;
    for (const word of words.filter((each) => each.part === part)) {
      const bits = parseInt(word.hex, 16);
      if (!byWord.has(bits)) byWord.set(bits, shades[next++ % shades.length]!);
    }
  };
  give("followers", FOLLOWERS);
  give("leader", LEADERS);
  const strong = words.map(({ hex }) => byWord.get(parseInt(hex, 16)) ?? UNKNOWN);
  return { strong, pale: strong.map(paler), byWord };
}

/** The colour of a word, as `#rrggbb`; undefined where the program has no such word. */
export function colourOfWord({ byWord }: WordColours, hex: string): string | undefined {
  const colour = byWord.get(parseInt(hex, 16));
  return colour === undefined ? undefined : hexColour(colour);
}

export function carColour(colours: WordColours, index: number, flags: number): number {
  if (index === NO_INDEX) return NOTHING;
  return (flags & Flag.runs ? colours.strong[index] : colours.pale[index]) ?? UNKNOWN;
}

/** The colour of a car's number plate, by which it is told from its neighbours; its body has that of its word. */
export function plateColour(car: number): string {
  // The golden angle: no two neighbours are alike, for any number of cars.
  return `hsl(${(car * 137.5) % 360} 85% 80%)`;
}

/** The colours that were asked for: there are few, and each car asks for its own with each picture. */
const hexes = new Map<number, string>();

/** `#rrggbb`. */
export function hexColour(colour: number): string {
  let hex = hexes.get(colour);
  if (!hex) hexes.set(colour, (hex = `#${colour.toString(16).padStart(6, "0")}`));
  return hex;
}

/** From the page's style sheets, so that light, dark and high contrast reach the canvas too. */
const NAMES = [
  "ground",
  "floor",
  "grid",
  "edge",
  "wall",
  "obstacle",
  "person",
  "track",
  "ring",
  "range",
  "lost",
  "accent",
  "leader",
  "follower",
] as const;

export type MatTheme = Record<(typeof NAMES)[number], string>;

/** The page's font, for texts on canvases: the names that it chooses from, as in `font-family`. */
export const pageFont = () => getComputedStyle(document.body).fontFamily;

/** Read the theme's colours by a probe element: a custom property's text may refer to other properties. */
export function readTheme(element: HTMLElement): MatTheme {
  const probe = document.createElement("span");
  probe.hidden = true;
  element.append(probe);
  const colours = NAMES.map((name) => {
    probe.style.color = `var(--mat-${name})`;
    return [name, getComputedStyle(probe).color];
  });
  probe.remove();
  return Object.fromEntries(colours) as MatTheme;
}

/** The colours of the page's style sheets that a canvas paints with, under names of its own: each of a custom property. */
export function readInks<Name extends string>(element: Element, properties: Record<Name, string>): Record<Name, string> {
  const style = getComputedStyle(element);
  const inks = Object.entries<string>(properties).map(([name, property]) => [name, style.getPropertyValue(property).trim()]);
  return Object.fromEntries(inks) as Record<Name, string>;
}

/** Whether all is shown in high contrast. */
export const isContrast = () => document.documentElement.dataset.theme === "contrast" || matchMedia("(forced-colors: active)").matches;

const PREFERENCES = ["(prefers-color-scheme: dark)", "(prefers-contrast: more)", "(forced-colors: active)"];

/** Call back whenever the colours may have changed; returns a function that ends this. */
export function watchTheme(changed: () => void): () => void {
  const observer = new MutationObserver(changed);
  observer.observe(document.documentElement, { attributeFilter: ["data-theme"] });
  return endAll(() => observer.disconnect(), ...PREFERENCES.map((query) => listen(matchMedia(query), ["change"], changed)));
}
