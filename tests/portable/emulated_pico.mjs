// An RP2040 on rp2040js with a program in its flash; its USB line is at a TCP port, and its receiver hears infrared.
// node emulated_pico.mjs OPTIONS prints {"port": ...}, with a boot ROM as soon as the USB line is there; OPTIONS is JSON:
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
const ROM_ENDS = 0x4000;
const SLICE_NANOS = 2_000_000;
const SAMPLE_NANOS = 50_000;
const SAMPLES = 400;
// The cache of the flash: 16 KB, two ways, lines of 8 bytes whose halves are read one by one. Source: RP2040's data
// sheet, chapter 2.6.3, and raspberrypi/pico-feedback, issue 307. A Pico needs 400 ns for a half. Source:
// oberon-rtk.org, Flash Memory.
const CACHE_SETS = 1024;
const MISS_NANOS = 400;
const RETURN = { IF: "", EX: "", FC: "", RE: "erase", RP: "program" };

const options = JSON.parse(process.argv[2]);
// rp2040js warns that it has no second core.
console.warn = () => {};
const flash = readFileSync(options.flash);
const bootRom = options.bootRom && new Uint32Array(new Uint8Array(readFileSync(options.bootRom)).buffer);
/** An RP2040 that waits for its flash, which rp2040js's does not. */
class WaitingChip extends RP2040 {
  waitNanos = 0;
  #tags = new Int32Array(2 * CACHE_SETS).fill(-1);
  #halves = new Uint8Array(2 * CACHE_SETS);
  #oldest = new Uint8Array(CACHE_SETS);

  readUint32(address) {
    if (address >>> 24 === 0x10) this.#readFlash(address);
    return super.readUint32(address);
  }
  readUint16(address) {
    if (address >>> 24 === 0x10) this.#readFlash(address);
    return super.readUint16(address);
  }
  readUint8(address) {
    if (address >>> 24 === 0x10) this.#readFlash(address);
    return super.readUint8(address);
  }
  emptyCache() {
    this.#tags.fill(-1);
  }
  #readFlash(address) {
    const set = (address >>> 3) & (CACHE_SETS - 1);
    const tag = address >>> 13;
    const half = address & 4 ? 2 : 1;
    let line = 2 * set;
    if (this.#tags[line] !== tag && this.#tags[line + 1] === tag) line += 1;
    else if (this.#tags[line] !== tag) {
      line += this.#oldest[set];
      this.#tags[line] = tag;
      this.#halves[line] = 0;
    }
    this.#oldest[set] = line & 1 ? 0 : 1;
    if (this.#halves[line] & half) return;
    this.#halves[line] |= half;
    this.waitNanos += MISS_NANOS;
  }
}

let client = null;
let chip = null;
let cdc = null;
let routines = new Map();
let startedNanos = 0;

/** Switch the chip on; of an earlier one it keeps the flash alone, as after a reset. */
function switchOn() {
  const before = chip;
  startedNanos = nowNanos();
  chip = new WaitingChip();
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
  cdc.onDeviceConnected = listen;
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
  if (what === "") chip.emptyCache();
  chip.core.PC = chip.core.LR & ~1;
}

/** Open the TCP port, once. */
function listen() {
  if (!server.listening) server.listen(0, "127.0.0.1", () => console.log(JSON.stringify({ port: server.address().port })));
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
  const { core, clock } = chip;
  const cycleNanos = 1e9 / chip.clkSys;
  const endNanos = clock.nanos + SLICE_NANOS;
  let dueNanos = 0;
  while (clock.nanos < endNanos && !isReset) {
    const routine = core.PC < ROM_ENDS ? routines.get(core.PC & ~1) : undefined;
    if (routine !== undefined) doRoutine(routine);
    if (core.waiting) clock.tick(Math.max(cycleNanos, Math.min(clock.nanosToNextAlarm, SAMPLE_NANOS)));
    else {
      const cycles = core.executeInstruction();
      clock.tick(cycles * cycleNanos + chip.waitNanos);
      chip.waitNanos = 0;
    }
    if (clock.nanos >= dueNanos) dueNanos = doWhatIsDue() - startedNanos;
  }
  if (isReset) switchOn();
  isReset = false;
  setImmediate(run);
}

/** Play what has to come, and look at the pins; return when something comes next. */
function doWhatIsDue() {
  while (waiting.length && waiting[0][0] <= nowNanos()) waiting.shift()[1]();
  if (nowNanos() >= sampledNanos + SAMPLE_NANOS) {
    sampledNanos = nowNanos();
    sample();
  }
  return Math.min(waiting[0]?.[0] ?? Infinity, sampledNanos + SAMPLE_NANOS);
}

const server = createServer((socket) => {
  client = socket;
  socket.on("error", () => {});
  socket.on("data", (bytes) => bytes.forEach((byte) => cdc.sendSerialByte(byte)));
});
switchOn();
if (!bootRom) listen();
createInterface({ input: process.stdin })
  .on("line", (line) => schedule(JSON.parse(line)))
  .on("close", () => process.exit());
run();
