// Runs conformance.py, its inputs.py and the portable files under MicroPython: node run_micropython.mjs SEED STEPS EVERY
import { readdirSync, readFileSync } from "node:fs";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const HERE = new URL("./", import.meta.url);
const SOURCE = new URL("../../src/motorcade/", import.meta.url);
const NEEDS_NUMPY = "bulk.py";
// MicroPython searches this folder of its in-memory filesystem.
const LIBRARY = "/lib";
const HEAP_BYTES = 16 * 1024 * 1024;

/** Copies the portable rooms into the in-memory filesystem; gives the names of their modules. */
function installMotorcade(fs) {
  const modules = [];
  fs.mkdirTree(`${LIBRARY}/motorcade`);
  // The real one finds the public names with CPython's importlib.
  fs.writeFile(`${LIBRARY}/motorcade/__init__.py`, "");
  for (const room of ["words", "car"]) {
    fs.mkdir(`${LIBRARY}/motorcade/${room}`);
    for (const file of readdirSync(new URL(room, SOURCE))) {
      if (!file.endsWith(".py") || file === NEEDS_NUMPY) continue;
      fs.writeFile(`${LIBRARY}/motorcade/${room}/${file}`, readFileSync(new URL(`${room}/${file}`, SOURCE)));
      modules.push(`motorcade.${room}.${file.slice(0, -".py".length)}`);
    }
  }
  return modules;
}

const python = await loadMicroPython({ heapsize: HEAP_BYTES, stdout: console.log });
const modules = installMotorcade(python.FS);
for (const file of ["inputs.py", "conformance.py"]) {
  python.FS.writeFile(`${LIBRARY}/${file}`, readFileSync(new URL(file, HERE)));
}
try {
  for (const name of modules) python.runPython(`import ${name}`);
  python.runPython(`from conformance import lines\nfound = lines(${process.argv.slice(2).join(", ")})`);
  // One line at a time: this build collects garbage only between calls from JavaScript.
  do {
    python.runPython("line = None\nfor line in found:\n    print(line)\n    break");
  } while (python.globals.get("line") !== null);
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
}
