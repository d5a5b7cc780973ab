import { expect, it } from "vitest";
import { clipOf, loadClips } from "./ClipPicture";

const MAT = { format: "motorcade-mat/1", name: "", car: [{ at_m: [0, 0], role: "leader" }] } as never;

it("shows a car between two stored moments on the line between them, turning the shorter way", () => {
  const clip = clipOf(MAT, [[100, 0, 250, 4], [200, 50, 2, 1]], { every_ms: 200, headings: 256 });
  expect(clip.durationMs).toBe(200);
  expect(clip.way).toEqual([[1, 0], [2, 0.5]]);
  const [car] = clip.at(100);
  expect(car).toMatchObject({ at: [1.5, 0.25], isLeader: true, led: 4 });
  expect(car!.headingDeg % 360).toBeCloseTo((254 / 256) * 360);
  expect(clip.at(10_000)[0]).toMatchObject({ at: [2, 0.5], led: 1 });
});

it("has a run of each example that changes within five seconds", async () => {
  for (const [id, clip] of await loadClips())
    expect(JSON.stringify(clip.at(5_000)), id).not.toBe(JSON.stringify(clip.at(0)));
});
