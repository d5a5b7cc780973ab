import { cleanup, render, screen, waitFor, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import { startTexts } from "../i18n";
import { useStudio } from "../state/studio";
import QuestionDialog from "../ui/QuestionDialog";
import { LibraryDialog } from "./ProjectDialogs";

const AT = "2026-03-01T10:00:00Z";
let asked: [name: string, message: unknown][] = [];
let names = ["Parade", "Robot"];
const ANSWERS: Record<string, (message: never) => unknown> = {
  "projects/list": () => names.map((name) => ({ name, saved_at: AT, versions: 2 })),
  "projects/place": () => ({ folder: "", problems: [] }),
  "projects/history": () => [2, 1].map((version) => ({ version, saved_at: AT })),
  "projects/delete": ({ name }: { name: string }) => void (names = names.filter((known) => known !== name)),
};

beforeAll(() => startTexts(texts));
beforeEach(() => {
  asked = [];
  names = ["Parade", "Robot"];
  connectTo({
    ask: (name, message) => {
      asked.push([name, message]);
      return Promise.resolve(ANSWERS[name]?.(message as never)) as never;
    },
    openStream: () => {
      throw new Error("no dialog of projects opens a stream");
    },
  });
});
afterEach(cleanup);

const entry = async (name: string) => within((await screen.findByRole("button", { name: new RegExp(`^${name}`) })).closest("li")!);

describe("the library", () => {
  it("lists projects with their versions, and deletes one when that was confirmed", async () => {
    const user = userEvent.setup({ delay: null });
    render(
      <>
        <LibraryDialog />
        <QuestionDialog />
      </>,
    );
    const robot = await entry("Robot");
    await user.click(robot.getByRole("button", { name: "2 versions" }));
    const versions = await robot.findByRole("list", { name: "Versions of Robot" });
    await waitFor(() => expect(within(versions).getAllByRole("listitem").map(({ textContent }) => textContent.slice(0, 9))).toEqual(["Version 2", "Version 1"]));
    for (const [answer, left] of [["Cancel", 2], ["Delete", 1]] as const) {
      await user.click((await entry("Robot")).getByRole("button", { name: "Delete Robot" }));
      await user.click(within(await screen.findByRole("alertdialog")).getByRole("button", { name: answer }));
      await waitFor(() => expect(screen.queryByRole("alertdialog")).toBeNull());
      await waitFor(() => expect(names).toHaveLength(left));
    }
    await waitFor(() => expect(screen.queryByRole("button", { name: /^Robot/ })).toBeNull());
    expect(asked.filter(([name]) => name === "projects/delete")).toEqual([["projects/delete", { name: "Robot" }]]);
  });

  it("saves no project without a name, and names the one that is open", async () => {
    const user = userEvent.setup({ delay: null });
    useStudio.setState({ name: "  " });
    render(<LibraryDialog />);
    const save = screen.getByRole("button", { name: "Save this project" });
    expect(save.matches(":disabled")).toBe(true);
    const field = screen.getByRole("textbox", { name: "Name" });
    await user.clear(field);
    await user.type(field, "Zebra");
    expect([useStudio.getState().name, save.matches(":disabled")]).toEqual(["Zebra", false]);
  });
});
