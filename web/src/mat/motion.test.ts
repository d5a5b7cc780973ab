import { expect, it } from "vitest";
import { Motion } from "./motion";
import { pictureOf } from "./pictures";

function motionOf(second: Parameters<typeof pictureOf>, gapMs = 33): Motion {
  const motion = new Motion();
  motion.take(pictureOf([{ x: 1, heading: 3.1 }]), 0);
  motion.take(pictureOf(...second), gapMs);
  return motion;
}

it("a car goes from one picture to the next, and turns the short way round", () => {
  const motion = motionOf([[{ x: 1.2, heading: -3.1 }]]);
  expect(motion.advance(33)).toBe(true);
  expect(motion.drawn.x[0]).toBeCloseTo(1);
  motion.advance(33 + 16.5);
  expect(motion.drawn.x[0]).toBeCloseTo(1.1);
  expect(Math.abs(motion.drawn.heading[0]!)).toBeCloseTo(Math.PI, 2);
  expect(motion.advance(66)).toBe(false);
  expect(motion.drawn.x[0]).toBeCloseTo(1.2);
});

it.each([
  ["was lifted", [[{ x: 5 }]]],
  ["is in the past", [[{ x: 1.2 }], { past: true }]],
  ["begins anew", [[{ x: 1.2 }], { fresh: true }]],
  ["has another crowd", [[{ x: 1.2 }, {}]]],
] as [string, Parameters<typeof pictureOf>][])("a picture is shown at once where it %s", (_, second) => {
  const motion = motionOf(second);
  motion.advance(33);
  expect(motion.drawn.x[0]).toBeCloseTo(second[0][0]!.x!);
});

it("the way back from the past is a leap", () => {
  const motion = motionOf([[{ x: 1.2 }], { past: true }]);
  motion.take(pictureOf([{ x: 1.4 }]), 66);
  motion.advance(66);
  expect(motion.drawn.x[0]).toBeCloseTo(1.4);
});

it("nothing is drawn before the first picture", () => {
  expect(new Motion().advance(0)).toBe(false);
});
