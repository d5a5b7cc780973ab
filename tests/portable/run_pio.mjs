// Run a PIO program on rp2040js, an emulator of the RP2040, instruction by instruction:
// node run_pio.mjs JSON prints, for each word after the first, the pin's edges as [[cycle, level], ...].
// JSON has the program's `words`, `wrap_target` and `wrap`, the `pin` that it sets, and the words to `put` into its FIFO;
// the first of them makes no edges.
import { RP2040 } from "rp2040js";

const TXF0 = 0x10;
const INSTR_MEM0 = 0x48;
const SM0_EXECCTRL = 0xcc;
const SM0_SHIFTCTRL = 0xd0;
const SM0_PINCTRL = 0xdc;
const MOST_STEPS = 1_000_000;

const { words, wrap_target, wrap, pin, put } = JSON.parse(process.argv[2]);
const pio = new RP2040().pio[0];
const machine = pio.machines[0];
words.forEach((word, at) => pio.writeUint32(INSTR_MEM0 + 4 * at, word));
pio.writeUint32(SM0_EXECCTRL, (wrap << 12) | (wrap_target << 7));
// Words are shifted out to the left, and nothing is pulled by itself.
pio.writeUint32(SM0_SHIFTCTRL, 0);
pio.writeUint32(SM0_PINCTRL, (1 << 26) | (1 << 20) | (pin << 5) | pin);

/** Put a word and run until the program waits for the next one; gives the edges. */
function run(word) {
  pio.writeUint32(TXF0, word);
  const edges = [];
  const begin = machine.cycles;
  for (let step = 0; step < MOST_STEPS; step++) {
    const at = machine.cycles - begin;
    const before = (pio.pinValues >>> pin) & 1;
    machine.step();
    const level = (pio.pinValues >>> pin) & 1;
    if (level !== before) edges.push([at, level]);
    if (machine.waiting && machine.txFIFO.empty) return edges;
  }
  throw new Error("the program doesn't end");
}

const all = put.map(run);
console.log(JSON.stringify(all.slice(1)));
