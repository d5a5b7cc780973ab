/** Python in this worker: Pyodide and Motorcade's shell, all from the site's own folder. */

import { unpack } from "./archive";
import type { Places } from "./protocol";

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

/** Start Python. Throws where a file is missing, or Python can't start. */
export async function startPython({ pyodide: indexURL, msgspec, python }: Places): Promise<Shell> {
  const unpacking = Promise.all([unpack(python), unpack(msgspec)]);
  // Whoever awaits it below handles its failure.
  unpacking.catch(() => undefined);
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
