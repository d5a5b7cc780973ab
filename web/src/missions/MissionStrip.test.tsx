import { act, cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeAll, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { useTrials } from "../certainty/trials";
import type { Luck, Mission } from "../generated/messages";
import { startTexts } from "../i18n";
import { useMat } from "../mat/store";
import { MissionStrip } from "./MissionStrip";
import { useMission } from "./store";

const text = (en: string) => ({ en, zh: en });
const MISSION = {
  id: "pass-it-on",
  name: text("Pass it on"),
  story: text("Tell them all."),
  goals: [1, 2, 3].map((star) => ({ kind: "lit", star, text: text("light up") })),
  hints: [],
  zones: [],
  steps: [],
  earned: [],
  edits: "blocks",
} as unknown as Mission;
const LUCK: Luck = { is: "luck", works: 0, tried: 0, of: 200, failed: [], stars: null };
const STARS = /2 of 3 stars/;

beforeAll(() => startTexts(texts));
afterEach(cleanup);

it("tells while the cars drive how many stars the program earns on all seeds of the mission", () => {
  useMission.setState({ mission: MISSION });
  useMat.setState({ state: { playing: true } as never });
  useTrials.setState({ luck: LUCK });
  render(<MissionStrip />);
  expect(screen.queryByText(STARS)).toBeNull();
  act(() => useTrials.setState({ luck: { ...LUCK, stars: [1, 2] } }));
  expect(screen.getByText(STARS).closest("[role=status]")).not.toBeNull();
  act(() => useMat.setState({ state: { playing: false } as never }));
  expect(screen.queryByText(STARS)).toBeNull();
});
