// Run a program for an ATmega328P in avr8js and print what its UART sends: run_avr8js.mjs PROGRAM.bin LINES
import { readFileSync } from "node:fs";
import { AVRUSART, CPU, avrInstruction, usart0Config } from "avr8js";

const [path, lines] = process.argv.slice(2);
const flash = new Uint8Array(32768);
flash.set(readFileSync(path));
const chip = new CPU(new Uint16Array(flash.buffer));
const uart = new AVRUSART(chip, usart0Config, 16e6);
let left = Number(lines);
uart.onByteTransmit = (byte) => {
    process.stdout.write(String.fromCharCode(byte));
    if (byte === 10) left -= 1;
};
while (left > 0) {
    avrInstruction(chip);
    chip.tick();
}
