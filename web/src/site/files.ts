/** The addresses of the site's files that are loaded by address: Python, the engine, and answers for the start. */

import { folder as pyodideFolder, wheel } from "virtual:pyodide";
import type { Places } from "./protocol";

// `motorcade site` writes it: a folder whose name changes with its content.
const folder = document.querySelector<HTMLMetaElement>('meta[name="motorcade-python"]')?.content ?? "";
const pyodide = new URL(pyodideFolder, document.baseURI).href;

/** The whole address of a file such as "start/profiles.json". */
export const fileUrl = (name: string) => new URL(folder + name, document.baseURI).href;

export const PLACES: Places = { pyodide, msgspec: pyodide + wheel, python: fileUrl("python.zip"), engine: fileUrl("engine.wasm") };
