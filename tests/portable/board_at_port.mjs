// Simulate boards that run MicroPython at a TCP port: the WebAssembly build, with its file system in memory, behind the
// raw prompt that MicroPython's documentation describes. (The build's own raw prompt mistakes commands of some lengths.)
// It is started once for all boards. A line of options on standard input makes a board in place of the one before, and
// prints its port; options are JSON:
//   platform: the value of sys.platform.     version: MicroPython's version, three numbers.
//   machine: what it calls itself.
//   freeBytes: free bytes of its flash.      runsCar: whether a car runs, which tools must interrupt first.
//   diesAfter: received bytes until the connection breaks.    silent: it answers nothing.
//   files: the files on it, path to text.    bytecode: the version of .mpy that it reads.
//   spoils: a file whose first byte flips when it is read for its checksum.
// "files" on standard input prints the files on it as JSON, path to hexadecimal, on standard output.
import { createServer } from "node:net";
import { createInterface } from "node:readline";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const CTRL_A = "\x01";
const CTRL_D = "\x04";
const RAW_PASTE = "\x05A\x01";
const PROMPT = "raw REPL; CTRL-B to exit\r\n>";
const INTERRUPT = /^[\r\x03]*\x03[\r\x03]*/;
const INTERRUPT_LENGTH = 3;

/** Make a board: its port, ``look`` for the files on it, and ``close``. */
async function makeBoard(options) {
  let client = null;
  let alive = true;

  const python = await loadMicroPython({
    heapsize: 4 * 1024 * 1024,
    linebuffer: false,
    stdout: (bytes) => send(bytes),
  });

  function send(bytes) {
    if (alive && client && !options.silent) client.write(bytes);
  }

  python.globals.set("platform", options.platform ?? "esp32");
  python.globals.set("version", (options.version ?? [1, 27, 0]).join(" "));
  python.globals.set("machine", options.machine ?? "");
  python.globals.set("bytecode", options.bytecode ?? 6);
  python.globals.set("free_bytes", options.freeBytes ?? 1024 * 1024);
  // The real module sys can't be changed, so an object with its attributes replaces it.
  python.runPython(`
import os, sys
from collections import namedtuple
class Sys:
    pass
replacement = Sys()
for name in dir(sys):
    setattr(replacement, name, getattr(sys, name))
replacement.platform = platform
kind = namedtuple("implementation", ("name", "version", "_mpy", "_machine"))
numbers = tuple([int(part) for part in version.split()])
replacement.implementation = kind("micropython", numbers, bytecode | 3 << 8, machine)
sys.modules["sys"] = replacement
os.statvfs = lambda path: (4096, 4096, 256, free_bytes // 4096)
class Machine:
    def reset(self):
        global restarted
        restarted = True
restarted = False
sys.modules["machine"] = Machine()
`);
  for (const [path, text] of Object.entries(options.files ?? {})) {
    python.FS.mkdirTree(path.slice(0, path.lastIndexOf("/") + 1));
    python.FS.writeFile(path, text);
  }
  if (options.spoils) {
    python.globals.set("spoiled", options.spoils);
    python.runPython(`
import builtins
real_open = open
def open(path, mode="r"):
    if path == spoiled and mode == "rb":
        with real_open(path, "rb") as file:
            data = file.read()
        with real_open(path, "wb") as file:
            file.write(bytes([data[0] ^ 1]) + data[1:])
    return real_open(path, mode)
builtins.open = open
`);
  }

  let running = options.runsCar ?? false;
  let recent = "";
  let left = options.diesAfter ?? Infinity;

  let command = "";

  function take(byte) {
    const character = String.fromCharCode(byte);
    if (running) {
      // Of the rules of motorcade.boards.on_chip.lines the one that our tools use: three of Ctrl-C and return end a car.
      recent = (recent + character).slice(-INTERRUPT_LENGTH);
      if (recent.length === INTERRUPT_LENGTH && INTERRUPT.exec(recent)?.[0] === recent) running = false;
    } else if (character === CTRL_A && command === "") {
      send(Buffer.from(PROMPT));
    } else if (character !== CTRL_D) {
      command += character;
      if (command.endsWith("\x03") || command === "\r") command = "";
      if (command !== RAW_PASTE) return;
      send(Buffer.from("R\x00"));
      command = "";
    } else if (command === "") {
      send(Buffer.from(`OK\r\nMPY: soft reboot\r\n${PROMPT}`));
    } else {
      execute(Buffer.from(command, "latin1").toString());
      command = "";
    }
  }

  function execute(source) {
    let problem = "";
    send(Buffer.from("OK"));
    try {
      python.runPython(source);
    } catch (error) {
      // WebAssembly numbers its errors otherwise than boards do.
      problem = error.message.replace(/OSError: 44$/m, "OSError: [Errno 2] ENOENT");
    }
    send(Buffer.from(`${CTRL_D}${problem}${CTRL_D}>`));
  }

  const server = createServer((socket) => {
    client = socket;
    socket.setNoDelay(true);
    socket.on("error", () => {});
    socket.on("data", (bytes) => {
      for (const byte of bytes) {
        left -= 1;
        if (left < 0) {
          alive = false;
          socket.destroy();
          return;
        }
        take(byte);
      }
    });
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));

  /** All files under ``folder``, path to hexadecimal. */
  function filesUnder(folder) {
    const found = {};
    for (const name of python.FS.readdir(folder)) {
      if (name === "." || name === "..") continue;
      const path = `${folder === "/" ? "" : folder}/${name}`;
      if (["/dev", "/proc", "/tmp", "/home"].includes(path)) continue;
      if (python.FS.isDir(python.FS.stat(path).mode)) Object.assign(found, filesUnder(path));
      else found[path] = Buffer.from(python.FS.readFile(path)).toString("hex");
    }
    return found;
  }

  function look() {
    // The connections after a broken one reach a board that was plugged in again.
    alive = true;
    left = Infinity;
    return { files: filesUnder("/"), restarted: python.globals.get("restarted") };
  }

  function close() {
    client?.destroy();
    server.close();
  }

  return { port: server.address().port, look, close };
}

let board = null;
for await (const line of createInterface({ input: process.stdin })) {
  if (line === "files") console.log(JSON.stringify(board.look()));
  else {
    board?.close();
    board = await makeBoard(JSON.parse(line));
    console.log(board.port);
  }
}
process.exit();
