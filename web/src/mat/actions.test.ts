import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Hello } from "../api/world";
import { useStudio } from "../state/studio";
import { playWhenReady, tapCar } from "./actions";
import { useMat } from "./store";

const cars = (count: number) => useMat.setState({ hello: { cars: count } as Hello });

describe("playing when the world is ready", () => {
  const pressed = vi.fn();
  beforeEach(() => {
    vi.useFakeTimers();
    useMat.setState({ hello: null });
    document.body.innerHTML = '<button id="mat-play"></button>';
    document.getElementById("mat-play")!.addEventListener("click", pressed);
  });
  afterEach(() => {
    vi.useRealTimers();
    pressed.mockReset();
  });

  it("presses Play once, when there are cars", () => {
    playWhenReady();
    cars(0);
    vi.runAllTimers();
    expect(pressed).not.toHaveBeenCalled();
    cars(13);
    vi.runAllTimers();
    cars(14);
    vi.runAllTimers();
    expect(pressed).toHaveBeenCalledTimes(1);
  });

  it("leaves another project that was opened meanwhile alone", () => {
    playWhenReady();
    useStudio.setState(({ generation }) => ({ generation: generation + 1 }));
    cars(13);
    vi.runAllTimers();
    expect(pressed).not.toHaveBeenCalled();
  });
});

it("a tap on a car asks for its word, another for the bits, and one on another car for that one's word", () => {
  const asked = [1, 1, 1, 2].map((car) => {
    tapCar(car);
    return useMat.getState().asked;
  });
  expect(asked).toEqual(["story", "bits", "story", "story"]);
  expect(useMat.getState().chosen).toEqual({ car: 2 });
});
