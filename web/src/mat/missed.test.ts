import { expect, it } from "vitest";
import { KINDS, LOSS_REASONS } from "../api/world";
import { MissedWords } from "./missed";
import { pictureOf } from "./testPictures";

const [HEARD, LOST] = [KINDS.indexOf("heard"), KINDS.indexOf("lost")];
const PARITY = LOST | (LOSS_REASONS.indexOf("parity") << 8);
const COLLIDED = LOST | (LOSS_REASONS.indexOf("collision") << 8);

/** A picture at a time, with events of a car: when, what, and of which word. */
const at = (tMs: number, events: (readonly [tMs: number, kind: number, word: number])[] = [], more = {}) =>
  pictureOf([{}, {}], { tMs, events: Uint32Array.from(events.flatMap(([eventMs, kind, word]) => [eventMs, 1, kind, word, 0])), ...more });

it("a word is missed where no other frame of it is heard soon before or after the lost one", () => {
  const missed = new MissedWords();
  expect(missed.take(at(100, [[100, HEARD, 14], [100, COLLIDED, 24]]))).toEqual([]);
  // A copy of what was heard, and a lost word that is heard after all.
  expect(missed.take(at(200, [[150, COLLIDED, 15], [180, LOST, 36]]))).toEqual([]);
  missed.take(at(400, [[300, HEARD, 36]]));
  expect(missed.take(at(1601))).toEqual([{ car: 1, collided: true }]);
  expect(missed.count).toBe(1);
  expect(missed.take(at(3000))).toEqual([]);
  expect(missed.count).toBe(1);
  missed.take(at(7000));
  expect(missed.count).toBe(0);
});

it("a damaged frame is a miss only where the car heard nothing meanwhile", () => {
  const missed = new MissedWords();
  missed.take(at(100, [[100, PARITY, 5]]));
  missed.take(at(200, [[200, HEARD, 14]]));
  expect(missed.take(at(2000))).toEqual([]);
  missed.take(at(5000, [[5000, PARITY, 5]]));
  expect(missed.take(at(7000))).toEqual([{ car: 1, collided: false }]);
});

it("many lost frames of one word are one miss; the past counts none, and another run begins at 0", () => {
  const missed = new MissedWords();
  missed.take(at(100, [[50, LOST, 7], [60, LOST, 7], [70, LOST, 7]]));
  expect(missed.take(at(9000, [], { past: true }))).toEqual([]);
  expect(missed.take(at(2000))).toHaveLength(1);
  missed.take(at(2100, [[2100, LOST, 8]]));
  expect(missed.take(at(0, [], { fresh: true }))).toEqual([]);
  expect(missed.take(at(4000))).toEqual([]);
  expect(missed.count).toBe(0);
});
