/** Python in this worker: Pyodide and Motorcade's shell, all from the site's own folder. */

import { unpack } from "./archive";

/** What is used of Pyodide's interface. */
interface Pyodide {
  pyimport: (name: string) => unknown;
}

interface FileSystem {
  mkdirTree: (path: string) => void;
  writeFile: (path: string, data: Uint8Array) => void;
}

interface PyodideModule {
  loadPyodide: (options: {
    indexURL: string;
    fsInit: (files: FileSystem, places: { sitePackages: string }) => Promise<void>;
  }) => Promise<Pyodide>;
}

/** A list of Python's; `destroy` releases it. */
export interface Sent {
  toJs: () => (string | Uint8Array<ArrayBuffer>)[];
  destroy: () => void;
}

/** `motorcade.browser.shell.Shell`. */
export interface Shell {
  answer: (name: string, message: string) => string;
  open: (stream: number, name: string, session: string) => Sent;
  receive: (stream: number, data: string | Uint8Array) => Sent;
  advance: (stream: number) => Sent;
  wait_s: (stream: number) => number;
  close: (stream: number) => void;
}

/** Motorcade's own modules, and the package that they need. */
const ARCHIVES = ["python.zip", "pyodide/msgspec.whl"];

/** Start Python; `site` is the address of the site's folder. Throws where a file is missing, or Python can't start. */
export async function startPython(site: string): Promise<Shell> {
  const unpacking = Promise.all(ARCHIVES.map((name) => unpack(new URL(name, site))));
  // Whoever awaits it below handles its failure.
  unpacking.catch(() => undefined);
  const indexURL = new URL("pyodide/", site).href;
  const { loadPyodide } = (await import(/* @vite-ignore */ `${indexURL}pyodide.mjs`)) as PyodideModule;
  const pyodide = await loadPyodide({
    indexURL,
    fsInit: async (files, { sitePackages }) => {
      for (const archive of await unpacking) {
        for (const [path, data] of archive) {
          const target = `${sitePackages}/${path}`;
          files.mkdirTree(target.slice(0, target.lastIndexOf("/")));
          files.writeFile(target, data);
        }
      }
    },
  });
  const boot = pyodide.pyimport("motorcade.browser.boot") as { start: () => Shell };
  return boot.start();
}
