/** What the user has chosen in this browser, from visit to visit. */

import { create } from "zustand";

export type ThemeName = "light" | "dark" | "contrast";
export const THEMES: readonly ThemeName[] = ["light", "dark", "contrast"];

interface Settings {
  theme: ThemeName;
  /** Whether the tour was ended or skipped. */
  toured: boolean;
  /** The port of the last upload. */
  port: string | null;
  /** The editors' share of the page's width, the leader's share of the editors', and the words' share of the height. */
  shares: { page: number; editors: number; words: number };
}

const KEY = "motorcade.settings";

export const useSettings = create<Settings>(() => ({
  theme: "light",
  toured: false,
  port: null,
  shares: { page: 0.6, editors: 0.5, words: 0.3 },
}));

function preferredTheme(): ThemeName {
  if (matchMedia("(prefers-contrast: more)").matches || matchMedia("(forced-colors: active)").matches) return "contrast";
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

function stored(): Partial<Settings> {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? "{}") as Partial<Settings>;
  } catch {
    return {};
  }
}

/** Read the settings, apply the theme, and store each change. To be called once, before anything is drawn. */
export function startSettings(): void {
  const applyTheme = () => (document.documentElement.dataset.theme = useSettings.getState().theme);
  useSettings.setState({ theme: preferredTheme(), ...stored() });
  applyTheme();
  useSettings.subscribe((settings) => {
    applyTheme();
    localStorage.setItem(KEY, JSON.stringify(settings));
  });
}
