import { expect, it } from "vitest";
import { useStudio } from "../state/studio";
import { duplicateChosen, removeChosen, tapCar } from "./actions";
import type { Mat } from "./document";
import { choose, useMat } from "./store";

it("a chosen car is copied to a free place, and taken away", () => {
  const mat: Mat = { format: "motorcade-mat/1", name: "Table", car: [{ at_m: [1, 1], role: "leader" }, { at_m: [2, 1] }] };
  useStudio.setState({ mat });
  choose({ car: 0 });
  duplicateChosen();
  expect(useStudio.getState().mat.car).toEqual([...mat.car!, { at_m: [1.25, 0.75], role: "leader" }]);
  expect(useMat.getState().chosen).toEqual({ car: 2 });
  removeChosen();
  expect(useStudio.getState().mat).toEqual(mat);
});

it("a tap on a car asks for its word, another for the bits, and one on another car for that one's word", () => {
  const asked = [1, 1, 1, 2].map((car) => {
    tapCar(car);
    return useMat.getState().asked;
  });
  expect(asked).toEqual(["story", "bits", "story", "story"]);
  expect(useMat.getState().chosen).toEqual({ car: 2 });
});
