// An RP2040 on rp2040js with a program in its flash; its USB line is at a TCP port, and its receiver hears infrared.
// node emulated_pico.mjs OPTIONS prints {"port": ...}; OPTIONS is JSON:
//   flash: a file with the flash's first bytes.   bootRom: a file with the 16 KB of the chip's own program, or null.
//   receiver: the pin that is low while infrared comes.   shows: pins.
// {"afterMs": ..., "everyUs": ..., "frames": [[mark, space, ...], ...]} on standard input plays frames. Just before each
// next one, and as long after the last, it prints {"high": [...], "falls": [...]}: for each pin of `shows` the share of
// the last 20 ms in which it was high, and how often it fell since the line before.
import { readFileSync } from "node:fs";
import { createServer } from "node:net";
import { createInterface } from "node:readline";
import { GPIOPinState, RP2040, USBCDC } from "rp2040js";

const FLASH_BEGINS = 0x10000000;
const STACK_ENDS = 0x20042000;
const CYCLE_NANOS = 8;
const SLICE_NANOS = 2_000_000;
const SAMPLE_NANOS = 50_000;
const SAMPLES = 400;
const RETURN = { IF: "", EX: "", FC: "", RE: "erase", RP: "program" };

const options = JSON.parse(process.argv[2]);
const flash = readFileSync(options.flash);
const bootRom = options.bootRom && new Uint32Array(new Uint8Array(readFileSync(options.bootRom)).buffer);
let client = null;
let chip = null;
let cdc = null;
let routines = new Map();
let startedNanos = 0;

/** Switch the chip on; of an earlier one it keeps the flash alone, as after a reset. */
function switchOn() {
  const before = chip;
  startedNanos = nowNanos();
  chip = new RP2040();
  chip.logger = { debug() {}, info() {}, warn() {}, error() {} };
  if (bootRom) chip.loadBootrom(bootRom);
  chip.flash.set(before ? before.flash : flash);
  chip.core.SP = STACK_ENDS;
  chip.core.PC = FLASH_BEGINS;
  chip.gpio[options.receiver].setInputValue(true);
  chip.peripherals[0x40058].onWatchdogTrigger = () => (isReset = true);
  routines = flashRoutines();
  cdc = new USBCDC(chip.usbCtrl);
  cdc.onSerialData = (bytes) => client?.write(bytes);
}

/** The addresses of the boot ROM's routines for the flash, which rp2040js has no flash chip for. */
function flashRoutines() {
  const found = new Map();
  if (!bootRom) return found;
  // The table is at the address in the third halfword of the header; a code of two letters, then an address.
  for (let at = chip.readUint16(0x14); chip.readUint16(at) !== 0; at += 4) {
    const code = String.fromCharCode(chip.readUint8(at), chip.readUint8(at + 1));
    if (code in RETURN) found.set(chip.readUint16(at + 2) & ~1, RETURN[code]);
  }
  return found;
}

/** Do what a routine of the boot ROM does, and return from it. */
function doRoutine(what) {
  const [first, second, third] = chip.core.registers;
  if (what === "erase") chip.flash.fill(0xff, first, first + second);
  if (what === "program") for (let i = 0; i < third; i++) chip.flash[first + i] &= chip.readUint8(second + i);
  chip.core.PC = chip.core.LR & ~1;
}

let isReset = false;
const nowNanos = () => startedNanos + (chip?.clock.nanos ?? 0);
const waiting = [];
const samples = [];
let sampledNanos = 0;
let falls = options.shows.map(() => 0);
let levels = options.shows.map(() => false);

function sample() {
  const now = options.shows.map((pin) => chip.gpio[pin].value === GPIOPinState.High);
  now.forEach((level, place) => (falls[place] += levels[place] && !level ? 1 : 0));
  levels = now;
  samples.push(now);
  if (samples.length > SAMPLES) samples.shift();
}

function show() {
  const high = options.shows.map((_, place) => samples.filter((levels) => levels[place]).length / samples.length);
  console.log(JSON.stringify({ high, falls }));
  falls = options.shows.map(() => 0);
}

function schedule({ afterMs, everyUs, frames }) {
  let beginNanos = nowNanos() + afterMs * 1e6;
  for (const durations of frames) {
    let at = beginNanos;
    durations.forEach((us, place) => {
      waiting.push([at, () => chip.gpio[options.receiver].setInputValue(place % 2 === 1)]);
      at += us * 1000;
    });
    waiting.push([at, () => chip.gpio[options.receiver].setInputValue(true)]);
    beginNanos += everyUs * 1000;
    waiting.push([beginNanos - 1, show]);
  }
  waiting.sort((one, other) => one[0] - other[0]);
}

/** Execute for some milliseconds of the chip's time, and let the sockets have theirs. */
function run() {
  const endNanos = nowNanos() + SLICE_NANOS;
  while (nowNanos() < endNanos) {
    const { core, clock } = chip;
    const routine = routines.get(core.PC & ~1);
    if (routine !== undefined) doRoutine(routine);
    const nanos = core.waiting ? Math.max(CYCLE_NANOS, Math.min(clock.nanosToNextAlarm, SAMPLE_NANOS)) : 0;
    clock.tick(nanos || core.executeInstruction() * CYCLE_NANOS);
    while (waiting.length && waiting[0][0] <= nowNanos()) waiting.shift()[1]();
    if (nowNanos() >= sampledNanos + SAMPLE_NANOS) {
      sampledNanos = nowNanos();
      sample();
    }
    if (isReset) {
      isReset = false;
      switchOn();
    }
  }
  setImmediate(run);
}

switchOn();
const server = createServer((socket) => {
  client = socket;
  socket.on("error", () => {});
  socket.on("data", (bytes) => bytes.forEach((byte) => cdc.sendSerialByte(byte)));
});
server.listen(0, "127.0.0.1", () => console.log(JSON.stringify({ port: server.address().port })));
createInterface({ input: process.stdin })
  .on("line", (line) => schedule(JSON.parse(line)))
  .on("close", () => process.exit());
run();
