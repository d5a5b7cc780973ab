/** What the plugin `texts` of vite.config.ts makes of the languages' files. */

declare module "virtual:texts/studio" {
  type Page = (typeof import("../../src/motorcade/locales/en.json"))["page"];
  export type Texts = Omit<Page, "remote" | "class" | "cars" | "network" | "errors">;
  const languages: Record<string, { name: string; texts: Texts }>;
  export default languages;
}

declare module "virtual:texts/remote" {
  export type Texts = (typeof import("../../src/motorcade/locales/en.json"))["page"]["remote"];
  const languages: Record<string, { name: string; texts: Texts }>;
  export default languages;
}

declare module "virtual:pyodide" {
  /** The folder of Pyodide's files, relative to the page's address. */
  export const folder: string;
  /** The name of msgspec's wheel in it. */
  export const wheel: string;
}

declare module "virtual:texts/cars" {
  export type Texts = (typeof import("../../src/motorcade/locales/en.json"))["page"]["cars"];
  const languages: Record<string, { name: string; texts: Texts }>;
  export default languages;
}

declare module "virtual:texts/network" {
  export type Texts = (typeof import("../../src/motorcade/locales/en.json"))["page"]["network"];
  const languages: Record<string, { name: string; texts: Texts }>;
  export default languages;
}

declare module "virtual:texts/class" {
  export type Texts = (typeof import("../../src/motorcade/locales/en.json"))["page"]["class"];
  const languages: Record<string, { name: string; texts: Texts }>;
  export default languages;
}
