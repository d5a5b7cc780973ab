/** A world that engine.wasm steps without Python, from a memory that `src/motorcade/browser/opening.py` has prepared. */

import { FIRST, PICTURE } from "../api/world";
import { EventColumn, HEADER, HEADER_BYTES, KINDS, LATELY_S } from "../generated/world";
import type { EngineInstance } from "./engine";

/** A number that differs from call to call: its place, and the value by which it is a constant and a factor. */
type Term = [place: number, constant: number, name: string, factor: number];
type Call = [kernel: string, block: number, terms: Term[]];
type Values = Record<string, number>;

/** How kernels are called, as `_World.recipe` of opening.py says; places are addresses. */
export interface Recipe {
  heap: number;
  run: Call[];
  most_ticks: number;
  count: number;
  rows: [from: number, to: number, bytes: number, most: number];
  take: Call[];
  packed: [place: number, bytes: number];
  show: Call[];
  picture: [place: number, bytes: number];
}

const LOST = KINDS.indexOf("lost");

export class SteppedWorld {
  /** How many ticks have passed. */
  tick = 0;
  private pictures = 0;
  /** The events since the last picture. */
  private events: Uint8Array[] = [];
  /** When frames were lost lately. */
  private lostMs: number[] = [];

  constructor(
    private readonly instance: EngineInstance,
    private readonly recipe: Recipe,
    memory: Uint8Array,
    private readonly tickMs: number,
    private readonly cars: number,
  ) {
    instance.grow(recipe.heap + memory.length);
    instance.view(recipe.heap, memory.length).set(memory);
  }

  get tMs(): number {
    return this.tick * this.tickMs;
  }

  run(ticks: number): void {
    for (let left = ticks; left > 0; ) {
      const count = Math.min(left, this.recipe.most_ticks);
      this.tick += count;
      this.call(this.recipe.run, { until: this.tick });
      left -= count;
      this.takeEvents();
    }
  }

  private takeEvents(): void {
    const { instance, recipe } = this;
    const [from, to, rowBytes, most] = recipe.rows;
    const counter = this.numberAt(recipe.count);
    const events = Math.min(Number(counter.getBigInt64(0, true)), most);
    if (!events) return;
    counter.setBigInt64(0, 0n, true);
    instance.copy(to, from, events * rowBytes);
    this.call(recipe.take, { events });
    const [place, bytes] = recipe.packed;
    const packed = instance.view(place, events * bytes).slice();
    this.events.push(packed);
    const rows = new DataView(packed.buffer);
    for (let at = 0; at < packed.length; at += bytes) {
      if (packed[at + 4 * EventColumn.kind] === LOST) this.lostMs.push(rows.getUint32(at + 4 * EventColumn.tMs, true));
    }
  }

  /** What the cars show now, with the events since the last picture: as Python's pictures, byte for byte. */
  picture(): ArrayBuffer {
    const { instance, recipe, tMs } = this;
    this.call(recipe.show, { tick: this.tick });
    const parts = [instance.view(...recipe.picture), ...this.events];
    this.events = [];
    this.lostMs = this.lostMs.filter((each) => each >= tMs - LATELY_S * 1000);
    const size = parts.reduce((sum, { length }) => sum + length, 0);
    const bytes = new Uint8Array(HEADER_BYTES + size);
    const head = new DataView(bytes.buffer);
    head.setUint8(HEADER.kind, PICTURE);
    head.setUint8(HEADER.flags, this.pictures === 0 ? FIRST : 0);
    head.setUint32(HEADER.number, ++this.pictures, true);
    head.setUint32(HEADER.t_ms, tMs, true);
    head.setUint32(HEADER.cars, this.cars, true);
    head.setUint32(HEADER.events, (size - recipe.picture[1]) / recipe.packed[1], true);
    head.setUint32(HEADER.lost, this.lostMs.length, true);
    let end = HEADER_BYTES;
    for (const part of parts) {
      bytes.set(part, end);
      end += part.length;
    }
    return bytes.buffer;
  }

  private call(calls: Call[], values: Values): void {
    for (const [kernel, block, terms] of calls) {
      for (const [place, constant, name, factor] of terms) this.numberAt(place).setBigInt64(0, BigInt(constant + factor * values[name]!), true);
      this.instance.call(kernel, block);
    }
  }

  private numberAt(address: number): DataView {
    const { buffer, byteOffset, length } = this.instance.view(address, 8);
    return new DataView(buffer, byteOffset, length);
  }
}
