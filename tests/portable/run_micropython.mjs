// Run a file of this folder under MicroPython, with Motorcade's portable files:
// node run_micropython.mjs MODULE ARGUMENT... prints what MODULE's lines(ARGUMENT...) yields; arguments are JSON.
// MOTORCADE_BOARD, a folder, stands for a board's files: what is installed there runs, and no file from here.
// A MODULE that imports `meter` finds executed() there, which counts instructions (meter.mjs).
import { readdirSync, readFileSync } from "node:fs";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const HERE = new URL("./", import.meta.url);
const SOURCE = new URL("../../src/motorcade/", import.meta.url);
// Portable folders, each with its files that aren't portable: no chip needs the formats, only the positions in them.
const PACKAGES = { words: ["field.py", "formats.py", "image.py", "uploader.py"], car: [], "car/check": [], "boards/on_chip": [] };
const FILES = ["errors.py", "boards/__init__.py", "boards/micropython.py"];
// MicroPython searches this folder of its in-memory filesystem.
const LIBRARY = "/lib";
// Counting allocated bytes takes as long as the heap is large.
const HEAP_BYTES = Number(process.env.MOTORCADE_HEAP_BYTES ?? 16 * 1024 * 1024);

/** The names of the Python files in a folder. */
function pythonFiles(folder) {
  return readdirSync(folder).filter((file) => file.endsWith(".py"));
}

/** Copies a file into the in-memory filesystem; gives its module's name. */
function copy(fs, from, path) {
  fs.mkdirTree(`${LIBRARY}/${path.slice(0, path.lastIndexOf("/"))}`);
  fs.writeFile(`${LIBRARY}/${path}`, readFileSync(from));
  return path.slice(0, -".py".length).replaceAll("/", ".");
}

/** Copies what the installer puts on a board, from a folder. */
function installBoard(fs, folder) {
  for (const entry of readdirSync(`${folder}/lib`, { recursive: true, withFileTypes: true })) {
    const path = `${entry.parentPath}/${entry.name}`;
    if (entry.isFile()) copy(fs, path, path.slice(`${folder}/lib/`.length).replaceAll("\\", "/"));
  }
  return [];
}

/** Copies the portable files; gives the names of their modules. */
function installMotorcade(fs) {
  const paths = [...FILES];
  for (const [folder, excluded] of Object.entries(PACKAGES)) {
    const files = pythonFiles(new URL(`${folder}/`, SOURCE)).filter((file) => !excluded.includes(file));
    paths.push(...files.map((file) => `${folder}/${file}`));
  }
  const modules = paths.map((path) => copy(fs, new URL(path, SOURCE), `motorcade/${path}`));
  // The real one finds the public names with CPython's importlib.
  fs.writeFile(`${LIBRARY}/motorcade/__init__.py`, "");
  return modules.map((name) => name.replace(".__init__", ""));
}

const [wanted, ...given] = process.argv.slice(2);
// Counting takes time.
const isMetered = readFileSync(new URL(`${wanted}.py`, HERE), "utf-8").includes("\nfrom meter import ");
const meter = isMetered ? await import("./meter.mjs") : null;
const python = await loadMicroPython({ heapsize: HEAP_BYTES, stdout: console.log });
if (meter) python.registerJsModule("meter", { executed: meter.executed });
const board = process.env.MOTORCADE_BOARD;
const modules = board ? installBoard(python.FS, board) : installMotorcade(python.FS);
for (const folder of board ? [] : ["", "simulated/"]) {
  for (const file of pythonFiles(new URL(`./${folder}`, HERE))) copy(python.FS, new URL(folder + file, HERE), folder + file);
}
copy(python.FS, new URL("../support/brain_steps.py", HERE), "support/brain_steps.py");
try {
  for (const name of modules) python.runPython(`import ${name}`);
  python.globals.set("given", given.join("\n"));
  python.runPython(`import json\nfrom ${wanted} import lines`);
  python.runPython("found = lines(*[json.loads(argument) for argument in given.split('\\n')])");
  // One line at a time: this build collects garbage only between calls from JavaScript.
  do {
    python.runPython("line = None\nfor line in found:\n    print(line)\n    break");
  } while (python.globals.get("line") !== null);
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
}
