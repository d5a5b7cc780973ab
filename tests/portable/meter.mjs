// Count the WebAssembly instructions that MicroPython executes: what a microcontroller would need in time, it needs here
// in instructions. Import this file before MicroPython is loaded; `executed()` returns the count.
//
// Before each instruction that ends a straight run of code, `counter += length of the run` is inserted. Source of the
// binary format: the WebAssembly core specification, chapter 5.

const CODE_SECTION = 10;
const GLOBAL_SECTION = 6;
const EXPORT_SECTION = 7;
const IMPORT_SECTION = 2;
const GLOBAL_KIND = 3;
const I32 = 0x7f;
const NAME = "executed_instructions";

let counter = null;

/** How many instructions were executed, modulo 2^30: a small integer of MicroPython. */
export function executed() {
  return counter.value & 0x3fffffff;
}

const instantiate = WebAssembly.instantiate;
WebAssembly.instantiate = async (bytes, imports) => {
  const result = await instantiate(counting(new Uint8Array(bytes)), imports);
  counter = result.instance.exports[NAME];
  return result;
};

class Reader {
  constructor(bytes, at = 0, end = bytes.length) {
    Object.assign(this, { bytes, at, end });
  }
  byte() {
    return this.bytes[this.at++];
  }
  number() {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = this.byte();
      value += (byte & 127) * 2 ** shift;
      if (byte < 128) return value;
    }
  }
  skipNumbers(count) {
    for (let i = 0; i < count; i++) while (this.byte() > 127);
  }
  skip(count) {
    this.at += count;
  }
}

/** An unsigned LEB128 number; also a signed one where it is below 64 in its last byte. */
function unsigned(value) {
  const bytes = [];
  do {
    bytes.push((value & 127) | (value > 127 ? 128 : 0));
    value = Math.floor(value / 128);
  } while (value > 0);
  return bytes;
}

function signed(value) {
  const bytes = unsigned(value);
  if (bytes[bytes.length - 1] & 64) {
    bytes[bytes.length - 1] |= 128;
    bytes.push(0);
  }
  return bytes;
}

/** The module ``bytes`` with a counter in it. */
function counting(bytes) {
  const reader = new Reader(bytes, 8);
  const sections = [];
  while (reader.at < reader.end) {
    const id = reader.byte();
    const length = reader.number();
    sections.push({ id, bytes: bytes.subarray(reader.at, reader.at + length) });
    reader.skip(length);
  }
  const body = (id) => new Reader(sections.find((section) => section.id === id)?.bytes ?? new Uint8Array([0]));
  const index = importedGlobals(body(IMPORT_SECTION)) + body(GLOBAL_SECTION).number();
  const parts = [bytes.subarray(0, 8)];
  for (const section of sections) {
    let changed = section.bytes;
    if (section.id === GLOBAL_SECTION) changed = withEntry(changed, [I32, 1, 0x41, 0, 0x0b]);
    if (section.id === EXPORT_SECTION) {
      changed = withEntry(changed, [NAME.length, ...Buffer.from(NAME), GLOBAL_KIND, ...unsigned(index)]);
    }
    if (section.id === CODE_SECTION) changed = countingCode(changed, index);
    parts.push(Uint8Array.from([section.id, ...unsigned(changed.length)]), changed);
  }
  return Buffer.concat(parts);
}

/** A section, which is a vector, with one entry more at its end. */
function withEntry(section, entry) {
  const reader = new Reader(section);
  const count = reader.number();
  return Buffer.concat([Uint8Array.from(unsigned(count + 1)), section.subarray(reader.at), Uint8Array.from(entry)]);
}

function importedGlobals(reader) {
  let found = 0;
  for (let left = reader.number(); left > 0; left--) {
    reader.skip(reader.number());
    reader.skip(reader.number());
    const kind = reader.byte();
    if (kind === 0) reader.skipNumbers(1);
    else if (kind === GLOBAL_KIND) (found += 1), reader.skip(2);
    else {
      if (kind === 1) reader.skip(1);
      reader.skipNumbers(reader.byte() & 1 ? 2 : 1);
    }
  }
  return found;
}

function countingCode(section, index) {
  const reader = new Reader(section);
  const count = reader.number();
  const parts = [Uint8Array.from(unsigned(count))];
  for (let i = 0; i < count; i++) {
    const length = reader.number();
    const counted = countingFunction(section.subarray(reader.at, reader.at + length), index);
    parts.push(Uint8Array.from(unsigned(counted.length)), counted);
    reader.skip(length);
  }
  return Buffer.concat(parts);
}

function countingFunction(body, index) {
  const reader = new Reader(body);
  for (let left = reader.number(); left > 0; left--) reader.skipNumbers(1), reader.skip(1);
  const parts = [];
  const global = unsigned(index);
  let from = 0;
  let run = 0;
  while (reader.at < reader.end) {
    const start = reader.at;
    const ends = skipInstruction(reader);
    if (!isFree(body[start])) run += 1;
    if (!ends || run === 0) continue;
    const add = [0x23, ...global, 0x41, ...signed(run), 0x6a, 0x24, ...global];
    parts.push(body.subarray(from, start), Uint8Array.from(add));
    from = start;
    run = 0;
  }
  parts.push(body.subarray(from));
  return Buffer.concat(parts);
}

/** Whether a compiler makes no machine instruction of it: bounds of blocks, local variables and constants. */
function isFree(code) {
  return (code >= 0x01 && code <= 0x03) || code === 0x05 || code === 0x0b || code === 0x1a || (code >= 0x20 && code <= 0x22) || (code >= 0x41 && code <= 0x44);
}

/** Skip an instruction with its operands; return whether it ends a straight run of code. */
function skipInstruction(reader) {
  const code = reader.byte();
  if (code <= 0x01 || code === 0x05 || code === 0x0b || code === 0x0f) return code !== 0x01; // else, end, return ...
  if (code <= 0x04) reader.skipNumbers(1); // block, loop, if
  else if (code <= 0x0d) reader.skipNumbers(1); // br, br_if
  else if (code === 0x0e) reader.skipNumbers(reader.number() + 1); // br_table
  else if (code === 0x10) reader.skipNumbers(1); // call
  else if (code === 0x11) reader.skipNumbers(2); // call_indirect
  else if (code === 0x1a || code === 0x1b) return false; // drop, select
  else if (code === 0x1c) return reader.skip(reader.number()), false; // select with types
  else if (code >= 0x20 && code <= 0x26) return reader.skipNumbers(1), false; // variables
  else if (code >= 0x28 && code <= 0x3e) return reader.skipNumbers(2), false; // memory
  else if (code <= 0x42) return reader.skipNumbers(1), false; // memory.size, memory.grow, constants
  else if (code === 0x43) return reader.skip(4), false;
  else if (code === 0x44) return reader.skip(8), false;
  else if (code === 0xfc) {
    const which = reader.number();
    reader.skipNumbers(which < 8 ? 0 : which === 9 || which === 11 || which === 13 || which >= 15 ? 1 : 2);
  } else if (code > 0xc4) throw new Error(`instruction 0x${code.toString(16)} is unknown`);
  return code <= 0x11;
}
