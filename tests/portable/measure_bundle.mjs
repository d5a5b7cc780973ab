// Import a car's files in MicroPython's WebAssembly build and count: node measure_bundle.mjs FOLDER HEAP_BYTES prints
// {"import", "live", "collect"} as JSON: executed instructions of the import, bytes in use after it, and instructions of
// a collection of garbage with the car and the largest image in memory. FOLDER is the root of a board's file system.
import { readdirSync, readFileSync } from "node:fs";
import { executed } from "./meter.mjs";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const [folder, heap] = process.argv.slice(2);
const python = await loadMicroPython({ heapsize: Number(heap) });
python.registerJsModule("meter", { executed });
for (const entry of readdirSync(`${folder}/lib`, { recursive: true, withFileTypes: true })) {
  if (!entry.isFile()) continue;
  const parent = entry.parentPath.slice(folder.length).replaceAll("\\", "/");
  python.FS.mkdirTree(parent);
  python.FS.writeFile(`${parent}/${entry.name}`, readFileSync(`${entry.parentPath}/${entry.name}`));
}

/** Instructions of ``source``, less those of running anything. */
function count(source) {
  // This build collects garbage when a call from JavaScript returns, if it was asked to.
  python.runPython("import gc, struct\nfrom meter import executed");
  python.runPython("before = executed()");
  python.runPython("pass");
  python.runPython("nothing = executed() - before\nbefore = executed()");
  python.runPython(source);
  python.runPython("counted = executed() - before - nothing");
  return python.globals.get("counted");
}

const imported = count("import motorcade.boards.on_chip.power_on");
count("gc.collect()");
python.runPython("live = gc.mem_alloc()");
const live = python.globals.get("live");
python.runPython("image = [bytes(2044), bytearray(2044), bytes(2044), bytes(2044)]");
count("gc.collect()");
console.log(JSON.stringify({ import: imported, live, collect: count("gc.collect()") }));
