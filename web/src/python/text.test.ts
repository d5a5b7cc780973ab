import { afterAll, afterEach, beforeAll, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo, RefusedError } from "../api/service";
import { startTexts } from "../i18n";
import { useDialogs } from "../state/dialogs";
import { editText, usePython } from "./text";

const TOO_LONG = { code: "too-many-in-a-row", severity: "error", sentence: { en: "Too many blocks.", zh: "" } };
const ask = vi.fn<(name: string) => Promise<unknown>>();

async function typeText(text: string): Promise<void> {
  editText(text);
  await vi.advanceTimersByTimeAsync(1000);
}

describe("a text that can't become blocks", () => {
  beforeAll(async () => {
    await startTexts(texts);
    connectTo({ ask: ask as never, openStream: vi.fn() });
    vi.useFakeTimers();
  });
  afterEach(() => ask.mockReset());
  afterAll(() => void vi.useRealTimers());

  it("stays as it was typed, with the reason", async () => {
    ask.mockImplementation((name) =>
      Promise.resolve(name === "python-to-blocks" ? { leader: null, diagnostics: [TOO_LONG] } : { text: "of the blocks", places: [], diagnostics: [] }),
    );
    await typeText("a thousand steps");
    expect(usePython.getState()).toMatchObject({ text: "a thousand steps", diagnostics: [TOO_LONG] });
  });

  it("is told about where the service refuses it whole", async () => {
    ask.mockRejectedValue(new RefusedError("body-too-large", { en: "Make it smaller.", zh: "" }));
    await typeText("a million steps");
    expect(useDialogs.getState().notices.map(({ text }) => text)).toContain("Make it smaller.");
  });
});
