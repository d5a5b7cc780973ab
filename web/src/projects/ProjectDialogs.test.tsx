import { Blob } from "node:buffer";
import { act, cleanup, render, screen, waitFor, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, beforeEach, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import { startTexts } from "../i18n";
import { useDialogs } from "../state/dialogs";
import { useStudio } from "../state/studio";
import QuestionDialog from "../ui/QuestionDialog";
import { ExamplesDialog, LibraryDialog, ShareDialog } from "./ProjectDialogs";
import { projectIn } from "./share";

const AT = "2026-03-01T10:00:00Z";
let asked: [name: string, message: unknown][] = [];
let names = ["Parade", "Robot"];
const EXAMPLE = { id: "made-up", title: { en: "A herd" }, about: { en: "All follow." }, difficulty: 2 };
const ANSWERS: Record<string, (message: never) => unknown> = {
  "projects/list": () => names.map((name) => ({ name, saved_at: AT, versions: 2 })),
  "projects/place": () => ({ folder: "", problems: [] }),
  "projects/history": () => [2, 1].map((version) => ({ version, saved_at: AT })),
  "save-text": () => ({ text: "the project" }),
  examples: () => [EXAMPLE],
  example: () => ({ ...useStudio.getState(), leader: { blocks: {} }, followers: null, python: null, level: null }),
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

describe("a link to share", () => {
  // That of jsdom can't be read as a stream.
  beforeEach(() => vi.stubGlobal("Blob", Blob));
  afterEach(() => vi.unstubAllGlobals());
  const shown = async () => {
    const link = screen.getByRole<HTMLInputElement>("textbox", { name: "Link" });
    await waitFor(() => expect(link.value).toContain("#"));
    return link;
  };

  it("has the whole project in it, and is copied", async () => {
    const user = userEvent.setup({ delay: null });
    useStudio.setState({ name: "Zebra" });
    render(<ShareDialog />);
    const { value } = await shown();
    expect(await projectIn(new URL(value).hash)).toEqual({ name: "Zebra", text: "the project" });
    await user.click(screen.getByRole("button", { name: "Copy" }));
    expect((await screen.findByText("The link is copied.")).getAttribute("role")).toBe("status");
    vi.unstubAllGlobals();
    expect(await navigator.clipboard.readText()).toBe(value);
  });

  it("is chosen whole where the browser lets no page copy it", async () => {
    Object.defineProperty(navigator, "clipboard", { value: undefined, configurable: true });
    render(<ShareDialog />);
    const link = await shown();
    expect(screen.queryByRole("button", { name: "Copy" })).toBeNull();
    act(() => link.focus());
    expect([link.selectionStart, link.selectionEnd]).toEqual([0, link.value.length]);
  });
});

it("an example opens as a project of its name, and the dialog closes", async () => {
  const user = userEvent.setup({ delay: null });
  useStudio.setState({ unsaved: false });
  useDialogs.setState({ open: "examples" });
  render(<ExamplesDialog />);
  await user.click(await screen.findByRole("button", { name: /^A herd/ }));
  await waitFor(() => expect(useStudio.getState().name).toBe("A herd"));
  expect(asked).toContainEqual(["example", { name: "made-up" }]);
  expect(useDialogs.getState().open).toBeNull();
});
