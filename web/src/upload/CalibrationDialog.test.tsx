import { cleanup, render, screen, waitFor } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo, RefusedError } from "../api/service";
import { PlayedStream } from "../api/testStream";
import type { CarFigures, CarReadings } from "../generated/messages";
import { startTexts } from "../i18n";
import { undo } from "../state/history";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { CalibrationDialog } from "./CalibrationDialog";

const MOVES = [
  { key: "slow", title: { en: "slowly ahead" }, turns: false, image: "AAAA" },
  { key: "left", title: { en: "turn left" }, turns: true, image: "BBBB" },
];
const CAR = { speeds_mm_s: [0, 90, 180, 270], turn_rates_deg_s: [0, 30, 60, 90], drift_mrad_per_m: 20, stopping_ms: 50 };
const FOUND: CarFigures = { told: [{ en: "It is slow." }], car: CAR, text: "# profile" };
const asked: CarReadings[] = [];

beforeAll(() => startTexts(texts));
afterEach(() => {
  cleanup();
  useSettings.setState({ ownCar: null });
  useStudio.setState({ car: null, profiles: [], capabilities: null });
});

it("sends each move, asks what a ruler shows, and lets the cars drive like the one that was measured", async () => {
  const user = userEvent.setup({ delay: null });
  connectTo({
    ask: (name, message) => {
      if (name === "calibration/moves") return Promise.resolve(MOVES);
      if (name === "ports") return Promise.resolve([{ port: "virtual:", description: "", kind: "virtual" }]) as never;
      const { readings } = message as CarReadings;
      asked.push({ readings });
      if (readings.slow?.startsWith("far")) return Promise.reject(new RefusedError("no-way", { en: "That is no way." }));
      return Promise.resolve(readings.left ? FOUND : { told: [], car: null, text: "" });
    },
    openStream: (_, __, listeners) => new PlayedStream(listeners),
  });
  const profile = { name: "classroom", speeds_mm_s: [0, 100, 200, 300], turn_rates_deg_s: [0, 30, 60, 90] };
  useStudio.setState({ profiles: [profile as never], capabilities: { serial_ports: true } as never });
  render(<CalibrationDialog />);
  await screen.findByText("Move 1 of 2: slowly ahead");
  // No move can be sent before the ports are known.
  await user.click(await screen.findByRole("radio", { name: /Simulated car/ }));
  await user.click(screen.getByRole("button", { name: "Upload" }));
  PlayedStream.all.at(-1)!.open();
  expect(PlayedStream.all.at(-1)!.messages).toMatchObject([{ image: "AAAA" }]);

  await user.type(screen.getByRole("textbox", { name: "cm ahead" }), "far");
  await user.click(screen.getByRole("button", { name: "Next" }));
  // The alert is there before it says anything.
  const alert = screen.getByRole("alert");
  await waitFor(() => expect(alert.textContent).toBe("That is no way."));
  await user.clear(screen.getByRole("textbox", { name: "cm ahead" }));
  await user.type(screen.getByRole("textbox", { name: "cm ahead" }), "27.5");
  await user.type(screen.getByRole("textbox", { name: /to the left/ }), "-3");
  await user.click(screen.getByRole("button", { name: "Next" }));
  await screen.findByText("Move 2 of 2: turn left");
  await user.type(screen.getByRole("textbox", { name: /degrees/ }), "265");
  await user.click(screen.getByRole("button", { name: "Next" }));
  await screen.findByText("It is slow.");
  expect(asked.at(-1)!.readings).toEqual({ slow: "27.5 -3", left: "265 " });

  await user.click(screen.getByRole("button", { name: "Let the cars drive like it" }));
  expect(useStudio.getState()).toMatchObject({ car: CAR, profileFigures: { speeds_mm_s: CAR.speeds_mm_s } });
  expect(useSettings.getState().ownCar).toEqual(CAR);
  undo();
  expect(useStudio.getState()).toMatchObject({ car: null, profileFigures: { speeds_mm_s: profile.speeds_mm_s } });
});
