/** What the user has chosen in this browser, from visit to visit. */

import { create } from "zustand";
import type { MeasuredCar } from "../api/types";
import { keep, replaceForbiddenStorage } from "./storage";

export type ThemeName = "light" | "dark" | "contrast";
export const THEMES: readonly ThemeName[] = ["light", "dark", "contrast"];

/** How much of the page is shown: blocks alone, words too, the program's text too. */
export type Level = "start" | "words" | "python";
export const LEVELS: readonly Level[] = ["start", "words", "python"];

const DRAWER_TABS = ["swarm", "things", "timeline", "words", "python", "sure"] as const;
export type DrawerTab = (typeof DRAWER_TABS)[number];

interface Settings {
  theme: ThemeName;
  level: Level;
  /** The level that the user had chosen before a mission chose one; null without a mission. */
  levelBefore: Level | null;
  /** What is looked up below blocks and stage, and whether it shows. */
  drawer: { tab: DrawerTab; open: boolean };
  /** Whether the tour was shown. */
  toured: boolean;
  /** The port of the last upload. */
  port: string | null;
  /** Whether the stage says in a sentence what the cars do. */
  caption: boolean;
  /** Whether the meaning of the colours is shown over the stage. */
  legend: boolean;
  /** Whether motors, messages and lights are heard. */
  sound: boolean;
  /** What the user is called where cars are driven; empty for no name, null before the page has asked. */
  userName: string | null;
  /** The car that was measured last in this browser. */
  ownCar: MeasuredCar | null;
  /** Whether a program has reached a car from this browser. */
  uploaded: boolean;
  /** The editors' share of the page's width, the leader's share of the editors', and the drawer's share of the height. */
  shares: { blocks: number; editors: number; drawer: number };
}

const KEY = "motorcade.settings";

type Check = (value: unknown) => boolean;
const isOneOf = (...allowed: readonly unknown[]): Check => (value) => allowed.includes(value);
const isSwitch = isOneOf(true, false);
const isTextOrNull: Check = (value) => value === null || typeof value === "string";
export const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);
const isObjectOrNull: Check = (value) => value === null || isObject(value);
const isDrawer: Check = (value) => isObject(value) && isOneOf(...DRAWER_TABS)(value.tab) && isSwitch(value.open);
const isShare = (value: unknown) => typeof value === "number" && value > 0 && value < 1;
const areShares: Check = (value) => isObject(value) && Object.values(value).every(isShare);

/** What each setting begins with, and whether what was stored of it can be used. */
const SETTINGS: { readonly [Name in keyof Settings]: readonly [first: Settings[Name], isGood: Check] } = {
  theme: ["light", isOneOf(...THEMES)],
  toured: [false, isSwitch],
  port: [null, isTextOrNull],
  caption: [true, isSwitch],
  legend: [false, isSwitch],
  sound: [true, isSwitch],
  userName: [null, isTextOrNull],
  ownCar: [null, isObjectOrNull],
  uploaded: [false, isSwitch],
  level: ["start", isOneOf(...LEVELS)],
  levelBefore: [null, isOneOf(...LEVELS, null)],
  drawer: [{ tab: "swarm", open: false }, isDrawer],
  shares: [{ blocks: 0.43, editors: 0.5, drawer: 0.38 }, areShares],
};

const firstSettings = () => Object.fromEntries(Object.entries(SETTINGS).map(([name, [first]]) => [name, first])) as unknown as Settings;

export const useSettings = create<Settings>(firstSettings);

/** Whether the page shows few kinds of blocks, and words in place of figures: its user has just begun. */
export const isStart = ({ level } = useSettings.getState()): boolean => level === "start";

/** Show a part of the drawer. */
export function openDrawer(tab: DrawerTab): void {
  useSettings.setState({ drawer: { tab, open: true } });
}

function preferredTheme(): ThemeName {
  if (matchMedia("(prefers-contrast: more)").matches || matchMedia("(forced-colors: active)").matches) return "contrast";
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

/** What was stored and can be used: another version of the page, or damage, may have left anything. */
function stored(): Partial<Settings> {
  let found: unknown;
  try {
    found = JSON.parse(localStorage.getItem(KEY) ?? "{}");
  } catch {
    return {};
  }
  const isGood = (name: string, value: unknown) => Object.hasOwn(SETTINGS, name) && SETTINGS[name as keyof Settings][1](value);
  const good = Object.entries(isObject(found) ? found : {}).filter(([name, value]) => isGood(name, value));
  return Object.fromEntries(good);
}

/** Read the settings, apply the theme, and store each change. To be called once, before anything is drawn or stored. */
export function startSettings(): void {
  replaceForbiddenStorage();
  const applyTheme = () => (document.documentElement.dataset.theme = useSettings.getState().theme);
  const { shares, ...others } = stored();
  useSettings.setState({ theme: preferredTheme(), ...others, shares: { ...useSettings.getState().shares, ...shares } });
  applyTheme();
  useSettings.subscribe((settings, before) => {
    // The stage is painted anew whenever the attribute is set.
    if (settings.theme !== before.theme) applyTheme();
    keep("localStorage", KEY, JSON.stringify(settings));
  });
}
