// Run a car's program on an ATmega328P in avr8js: run_avr8js.mjs PROGRAM.bin < what.json
// what.json: {"sends": [[when in ms, bytes in hex], ...], "untilMs": n, "edgesFromMs": n}; each send follows the one before.
// It prints {"received": hex, "eeprom": hex, "edges": [[cycle, level], ...]}.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const avr8js = createRequire(new URL("../export/", import.meta.url))("avr8js");
const { AVREEPROM, AVRIOPort, AVRTimer, AVRUSART, CPU, EEPROMMemoryBackend, avrInstruction } = avr8js;
const what = JSON.parse(readFileSync(0, "utf8"));
const FREQUENCY = 16e6;
const CYCLES_A_MS = FREQUENCY / 1000;
const BYTE_CYCLES = Math.round((FREQUENCY * 10) / 115200);
const CARRIER_BIT = 3; // OC2A

const flash = new Uint8Array(32768);
flash.set(readFileSync(process.argv[2]));
const chip = new CPU(new Uint16Array(flash.buffer));
const eeprom = new EEPROMMemoryBackend(1024);
new AVREEPROM(chip, eeprom);
for (const config of [avr8js.timer0Config, avr8js.timer1Config, avr8js.timer2Config]) new AVRTimer(chip, config);
const ports = [avr8js.portBConfig, avr8js.portCConfig, avr8js.portDConfig].map((config) => new AVRIOPort(chip, config));
const uart = new AVRUSART(chip, avr8js.usart0Config, FREQUENCY);

const received = [];
uart.onByteTransmit = (byte) => received.push(byte);
const edges = [];
let level = 0;
ports[0].addListener((pins) => {
    const now = (pins >> CARRIER_BIT) & 1;
    if (now !== level && chip.cycles >= what.edgesFromMs * CYCLES_A_MS) edges.push([chip.cycles, now]);
    level = now;
});
const bytes = [];
let next = 0;
for (const [ms, hex] of what.sends) {
    next = Math.max(next, ms * CYCLES_A_MS);
    for (const byte of Buffer.from(hex, "hex")) bytes.push([(next += BYTE_CYCLES), byte]);
}
let sent = 0;
while (chip.cycles < what.untilMs * CYCLES_A_MS) {
    avrInstruction(chip);
    chip.tick();
    if (sent < bytes.length && chip.cycles >= bytes[sent][0]) uart.writeByte(bytes[sent++][1], true);
}
const hex = (data) => Buffer.from(data).toString("hex");
console.log(JSON.stringify({ received: hex(received), eeprom: hex(eeprom.memory), edges }));
