/**
 * Python's bytecode, made while the page is built: a browser that compiles Python's sources itself takes most of a first
 * start for it.
 */

import { createRequire } from "node:module";
import { join } from "node:path";

const SOURCES = join(import.meta.dirname, "../src");

/** Finds the modules of a start, and compiles each by the Python that runs it. */
const COMPILE = `
import importlib, io, sys, zipfile
from importlib._bootstrap_external import _code_to_hash_pyc
from importlib.util import cache_from_source, source_hash
from pathlib import PurePosixPath

STDLIB = next(place for place in sys.path if place.endswith(".zip"))


def bytecode(source, name, is_checked):
    code = compile(source, name, "exec", dont_inherit=True)
    return bytes(_code_to_hash_pyc(code, source_hash(source), is_checked))


def packed(files):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as target:
        for name, data in sorted(files.items()):
            # Without a time: the same files give the same archive.
            target.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def started(folder):
    """The files below a folder whose modules are imported by now."""
    files = (getattr(module, "__file__", None) for module in list(sys.modules.values()))
    return {PurePosixPath(file).relative_to(folder).as_posix() for file in files if file and file.startswith(f"{folder}/")}


def standard_library():
    needed = started(STDLIB)
    files = {}
    with zipfile.ZipFile(STDLIB) as archive:
        for name in archive.namelist():
            if name.endswith("/"):
                continue
            data = archive.read(name)
            if name in needed:
                files[f"{name}c"] = bytecode(data, name, False)
            else:
                files[name] = data
    return packed(files)


def packages(folder):
    files = {}
    for name in started(folder):
        if name.endswith(".py"):
            with open(f"{folder}/{name}", "rb") as file:
                files[cache_from_source(name)] = bytecode(file.read(), name, True)
    return files
`;

/** What of Pyodide is used here. */
interface Pyodide {
  mountNodeFS: (path: string, folder: string) => void;
  unpackArchive: (archive: Uint8Array, format: string, options: { extractDir: string }) => void;
  runPython: (code: string) => unknown;
}

/**
 * The standard library with the modules of a start as bytecode, and the bytecode of those of Motorcade and msgspec, each beside
 * its source. Python compares the latter with the sources, and compiles what has changed since.
 *
 * @param wheel msgspec's.
 */
export async function bytecode(wheel: Buffer): Promise<{ stdlib: Uint8Array; packages: Uint8Array }> {
  const { loadPyodide } = (await import(createRequire(import.meta.url).resolve("pyodide/pyodide.mjs"))) as { loadPyodide: () => Promise<Pyodide> };
  const python = await loadPyodide();
  python.mountNodeFS("/sources", SOURCES);
  python.unpackArchive(new Uint8Array(wheel), "zip", { extractDir: "/wheel" });
  python.runPython(`
import sys
sys.dont_write_bytecode = True
sys.path[:0] = ["/sources", "/wheel"]
import motorcade.browser.preload, motorcade.browser.shell
`);
  python.runPython(COMPILE);
  const made = (code: string) => (python.runPython(code) as { toJs: () => Uint8Array }).toJs();
  return { stdlib: made("standard_library()"), packages: made('packed(packages("/sources") | packages("/wheel"))') };
}
