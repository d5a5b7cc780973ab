/** Pictures for tests. */

import { Flag, NO_INDEX, type Picture } from "../api/world";
import { columnBytes, type Columns, columnsOf } from "../generated/world";

type DrawnCar = Partial<Record<keyof Columns, number>>;

const PLAIN: DrawnCar = { index: NO_INDEX, led: 4, flags: Flag.runs };

export function pictureOf(cars: readonly DrawnCar[], more: Partial<Picture> = {}): Picture {
  const columns = columnsOf(new ArrayBuffer(columnBytes(cars.length)), 0, cars.length);
  for (const name of Object.keys(columns) as (keyof Columns)[]) cars.forEach((car, k) => (columns[name][k] = car[name] ?? PLAIN[name] ?? 0));
  return { frame: 1, tMs: 0, past: false, fresh: false, cars: cars.length, lost: 0, ...columns, events: new Uint32Array(), ...more };
}
