/** Python in this worker: Pyodide and Motorcade's shell, all from the site's own folder. */

import { unpack } from "./archive";
import { type EngineInstance, openEngine } from "./engine";
import type { Places } from "./protocol";
import { canStore, storedSnapshot, storeSnapshot } from "./snapshot";

/** What is used of Pyodide's interface. */
interface Pyodide {
  pyimport: (name: string) => unknown;
  runPython: (code: string) => unknown;
  makeMemorySnapshot: () => Uint8Array<ArrayBuffer>;
  _module: { HEAP8: Int8Array };
}

interface FileSystem {
  mkdirTree: (path: string) => void;
  writeFile: (path: string, data: Uint8Array) => void;
}

interface Options {
  indexURL: string;
  fsInit: (files: FileSystem, places: { sitePackages: string }) => Promise<void>;
  _makeSnapshot: boolean;
  _loadSnapshot: Uint8Array;
}

/** A list of Python's; `destroy` releases it. */
export interface Sent {
  toJs: () => (string | Uint8Array<ArrayBuffer>)[];
  destroy: () => void;
}

/** `motorcade.browser.storage.BrowserStorage`; texts are JSON. */
export interface PythonStorage {
  readonly revision: number;
  load: (index: string) => void;
  wanted: () => string;
  supply: (texts: string) => void;
  changes: () => string;
  settle: (revision: number) => void;
  take_car_image: () => string;
}

/** `motorcade.browser.shell.Shell`. */
export interface Shell {
  readonly storage: PythonStorage;
  answer: (name: string, message: string) => string;
  refuse: (why: string) => string;
  open: (stream: number, name: string, session: string) => Sent;
  receive: (stream: number, data: string | Uint8Array) => Sent;
  advance: (stream: number) => Sent;
  wait_s: (stream: number) => number;
  close: (stream: number) => void;
}

/** Start Python. Throws where a file is missing, or Python can't start. */
export async function startPython(places: Places): Promise<Shell> {
  const stored = await storedSnapshot(places.python);
  try {
    return await startFrom(places, stored);
  } catch (error) {
    if (!stored) throw error;
    // It may be damaged. The next visit has another one.
    await storeSnapshot(places.python, null);
    return startFrom(places, null);
  }
}

async function startFrom(places: Places, snapshot: Uint8Array | null): Promise<Shell> {
  const unpacking = Promise.all([places.python, places.msgspec, places.bytecode].map(unpack));
  // Whoever awaits it below handles its failure.
  unpacking.catch(() => undefined);
  const opening = openEngine(places.engine);
  opening.catch(() => undefined);
  const { loadPyodide } = (await import(/* @vite-ignore */ `${places.pyodide}pyodide.mjs`)) as { loadPyodide: (options: Partial<Options>) => Promise<Pyodide> };
  const python = await loadPyodide({
    indexURL: places.pyodide,
    fsInit: async (files, { sitePackages }) => write(await unpacking, files, sitePackages),
    ...(snapshot ? { _loadSnapshot: snapshot } : { _makeSnapshot: canStore() }),
  });
  const engine = await opening;
  const heap = python._module.HEAP8.length;
  if (snapshot) {
    // All that begin with one snapshot would draw the same numbers.
    python.runPython("import random; random.seed()");
  } else if (canStore()) {
    python.runPython("import motorcade.browser.preload");
    // Pyodide can't begin with a memory that has grown (its issue 6254).
    if (python._module.HEAP8.length === heap) void storeSnapshot(places.python, python.makeMemorySnapshot());
  }
  const shell = python.pyimport("motorcade.browser.shell") as { start: (openInstance: () => EngineInstance) => Shell };
  return shell.start(() => engine.instance());
}

function write(archives: [path: string, data: Uint8Array][][], files: FileSystem, folder: string): void {
  // A snapshot can't be made of a Python that knows of installed packages.
  for (const [path, data] of archives.flat().filter(([name]) => !name.includes(".dist-info/"))) {
    const target = `${folder}/${path}`;
    files.mkdirTree(target.slice(0, target.lastIndexOf("/")));
    files.writeFile(target, data);
  }
}
