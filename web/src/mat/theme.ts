/** The mat's colours, from the page's style sheets, so that light, dark and high contrast reach the canvas too. */

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
] as const;

export type MatTheme = Record<(typeof NAMES)[number], string>;

/** A probe's colour, since a custom property itself is text that may name other properties. */
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

const PREFERENCES = ["(prefers-color-scheme: dark)", "(prefers-contrast: more)", "(forced-colors: active)"];

/** Call back whenever the colours may have changed; gives what ends it. */
export function watchTheme(changed: () => void): () => void {
  const observer = new MutationObserver(changed);
  observer.observe(document.documentElement, { attributes: true });
  observer.observe(document.body, { attributes: true });
  const queries = PREFERENCES.map((query) => matchMedia(query));
  queries.forEach((query) => query.addEventListener("change", changed));
  return () => {
    observer.disconnect();
    queries.forEach((query) => query.removeEventListener("change", changed));
  };
}
