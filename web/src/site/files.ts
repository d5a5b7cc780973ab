/** The addresses of the site's files that are loaded by address: Python, the engine, and answers for the start. */

import pyodide from "virtual:pyodide";

// `motorcade site` writes it: a folder whose name changes with its content.
const folder = document.querySelector<HTMLMetaElement>('meta[name="motorcade-python"]')?.content ?? "";

/** The folder of Pyodide's files, with a slash at its end. */
export const PYODIDE = new URL(pyodide, document.baseURI).href;

/** The whole address of a file such as "python.zip", "engine.wasm" or "start/profiles.json". */
export const fileUrl = (name: string) => new URL(folder + name, document.baseURI).href;
