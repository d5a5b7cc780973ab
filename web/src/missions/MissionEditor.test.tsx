import { cleanup, render, screen, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { startTexts } from "../i18n";
import { leaveDraft, openDraft, useDraft } from "./draft";
import { MissionEditor } from "./MissionEditor";

beforeAll(() => startTexts(texts));
beforeEach(() => openDraft());
afterEach(() => {
  cleanup();
  leaveDraft();
});

function Editor() {
  const draft = useDraft((state) => state.draft);
  return draft && <MissionEditor draft={draft} />;
}

const draft = () => useDraft.getState().draft!;
const group = (name: string) => within(screen.getByRole("group", { name }));

describe("the editor of missions", () => {
  it("renames a zone in the goals that name it, and says where one lies beside the mat", async () => {
    const user = userEvent.setup({ delay: null });
    render(<Editor />);
    const name = group("home").getByRole("textbox", { name: "Name of the zone" });
    await user.tripleClick(name);
    await user.keyboard("yard");
    expect(draft().zones.map(({ name, title }) => [name, title.en])).toEqual([["yard", "yard"]]);
    expect(draft().goals).toMatchObject([{ kind: "in-zone", zone: "yard" }]);
    expect(screen.queryByText(/beside the mat/)).toBeNull();
    await user.tripleClick(group("yard").getByRole("textbox", { name: "From left (m)" }));
    await user.keyboard("900{Enter}");
    expect((await screen.findByText(/beside the mat/)).getAttribute("role")).toBe("status");
  });

  it("asks of each kind of goal what it needs; one goal stays", async () => {
    const user = userEvent.setup({ delay: null });
    render(<Editor />);
    const remove = (number: number) => screen.getByRole("button", { name: `Remove goal ${number}` });
    expect(remove(1).matches(":disabled")).toBe(true);
    await user.click(screen.getByRole("button", { name: "Goal" }));
    expect(draft().goals.map(({ kind }) => kind)).toEqual(["in-zone", "no-touch"]);
    await user.click(group("Goal 2").getByRole("button", { name: /What is asked/ }));
    await user.click(await screen.findByRole("option", { name: "be in a zone" }));
    expect(draft().goals[1]).toMatchObject({ kind: "in-zone", zone: "home", star: 1 });
    await user.click(remove(1));
    expect(draft().goals).toHaveLength(1);
  });
});
