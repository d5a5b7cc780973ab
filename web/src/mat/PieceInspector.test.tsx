import { cleanup, render, screen, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { startTexts } from "../i18n";
import { useStudio } from "../state/studio";
import type { Mat } from "./document";
import { PieceInspector, Voices } from "./PieceInspector";
import { choose } from "./store";

const MAT: Mat = {
  ...{ format: "motorcade-mat/1", name: "Hall", size_m: [4, 3] },
  wall: [{ from_m: [0, 0], to_m: [1, 0] }],
  person: [{ path: [[0, 1, 1], [4, 2, 1], [8, 1, 1]], repeats: true }],
};
const mat = () => useStudio.getState().mat;

beforeAll(() => startTexts(texts));
afterEach(() => {
  cleanup();
  choose(null);
});

/** Type a number over that of a field, as somebody does who uses the keyboard alone. */
async function enter(user: ReturnType<typeof userEvent.setup>, field: HTMLElement, number: string): Promise<void> {
  await user.tripleClick(field);
  await user.keyboard(`${number}{Enter}`);
}

describe("the list of things", () => {
  it("shows a chosen piece's points as numbers, which move it", async () => {
    const user = userEvent.setup({ delay: null });
    useStudio.setState({ mat: MAT });
    render(<PieceInspector />);
    await user.click(screen.getByRole("option", { name: "Wall 1" }));
    const end = within(screen.getByRole("group", { name: "Point 2" }));
    await enter(user, end.getAllByRole("textbox")[0]!, "2.5");
    expect(mat().wall).toEqual([{ from_m: [0, 0], to_m: [2.5, 0] }]);
    expect(end.queryByRole("button", { name: /^Add/ })).toBeNull();
  });

  it("lets a walk get and lose points, but not its first time", async () => {
    const user = userEvent.setup({ delay: null });
    useStudio.setState({ mat: MAT });
    choose({ piece: { kind: "person", place: 0 } });
    render(<PieceInspector />);
    const points = () => screen.getAllByRole("group", { name: /^Point/ });
    const [time] = within(points()[0]!).getAllByRole<HTMLInputElement>("textbox");
    expect(time!.disabled).toBe(true);
    await enter(user, within(points()[1]!).getAllByRole("textbox")[0]!, "6");
    expect(mat().person![0]!.path.map(([t]) => t)).toEqual([0, 6, 10]);
    await user.click(within(points()[2]!).getAllByRole("button").at(-1)!);
    expect(points()).toHaveLength(2);
    await user.click(screen.getByRole("button", { name: "Repeat the walk" }));
    expect(mat().person![0]!.repeats).toBe(false);
  });
});

describe("voices", () => {
  it("begin with 'stop', take turns, and are heard everywhere or in an area", async () => {
    const user = userEvent.setup({ delay: null });
    useStudio.setState({ mat: { ...MAT, voice: undefined } });
    render(<Voices />);
    const add = screen.getByRole("button", { name: "Add a voice" });
    await user.click(add);
    await user.click(add);
    expect(mat().voice).toEqual([{ at_s: 2, word: "stop" }, { at_s: 4, word: "go" }]);
    const second = within(screen.getByRole("group", { name: "Voice 2" }));
    await user.click(second.getByRole("button", { name: "Heard everywhere" }));
    expect(mat().voice![1]).toEqual({ at_s: 4, word: "go", centre_m: [2, 1.5], radius_m: 1 });
    for (const left of [1, 0]) {
      await user.click(screen.getByRole("button", { name: "Remove voice 1" }));
      expect(mat().voice ?? []).toHaveLength(left);
    }
  });
});
