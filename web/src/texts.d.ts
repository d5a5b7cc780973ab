/** What plugins of vite.config.ts make. */

declare module "virtual:texts/*" {
  const languages: import("./i18n").Languages;
  export default languages;
}

declare module "virtual:pyodide" {
  /** The folder of Pyodide's files, relative to the page's address. */
  export const folder: string;
  /** The name of msgspec's wheel in it. */
  export const wheel: string;
}
