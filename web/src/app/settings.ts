/** What the user has set up for this browser, and keeps from visit to visit. */

import { create } from "zustand";

export type ThemeName = "light" | "dark" | "contrast";
export const THEMES: readonly ThemeName[] = ["light", "dark", "contrast"];

interface Settings {
  theme: ThemeName;
  toured: boolean;
  /** The port that was last uploaded to. */
  port: string | null;
  /** The editors' share of the page's width, and the leader's of the editors'. */
  shares: { page: number; editors: number; words: number };
}

const KEPT = "motorcade.settings";

function wishedTheme(): ThemeName {
  if (matchMedia("(prefers-contrast: more)").matches || matchMedia("(forced-colors: active)").matches) return "contrast";
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

function kept(): Partial<Settings> {
  try {
    return JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Partial<Settings>;
  } catch {
    return {};
  }
}

export const useSettings = create<Settings>(() => ({
  theme: wishedTheme(),
  toured: false,
  port: null,
  shares: { page: 0.6, editors: 0.5, words: 0.3 },
  ...kept(),
}));

useSettings.subscribe((settings) => {
  document.documentElement.dataset.theme = settings.theme;
  localStorage.setItem(KEPT, JSON.stringify(settings));
});
document.documentElement.dataset.theme = useSettings.getState().theme;
