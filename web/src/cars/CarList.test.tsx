import { act, cleanup, render, screen, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { renderToString } from "react-dom/server";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/class";
import type { CarRow, CarsAnswer } from "../generated/messages";
import { changeLanguage, startTexts } from "../i18n";
import { CarList } from "./CarList";

/** The other end of the page's WebSocket. */
class Socket extends EventTarget {
  static readonly OPEN = 1;
  static last: Socket;
  readyState = Socket.OPEN;
  readonly orders: unknown[] = [];

  constructor() {
    super();
    Socket.last = this;
  }

  send(text: string): void {
    this.orders.push(JSON.parse(text));
  }

  close(): void {
    this.dispatchEvent(new Event("close"));
  }

  say(answer: CarsAnswer): void {
    act(() => void this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(answer) })));
  }
}

const CAR: CarRow = { name: "Ada", where: "a", kind: "car", number: 1, role: "leader", board: "", version: "", state: "", words: null, crc32: null, battery_mv: null, away: false, silent_s: null, program: "", problem: null, sent: null, holds: "", error: null };
const CARS: CarRow[] = [CAR, { ...CAR, name: "Bo", where: "b", role: "follower" }, { ...CAR, name: "Cy", where: "c", away: true, silent_s: 40 }];
const show = (cars: CarRow[]) => Socket.last.say({ is: "cars", cars, others: [], problem: null });
const row = (name: string) => within(screen.getByText(name).closest("li")!);

beforeAll(() => startTexts(texts));
afterAll(() => changeLanguage("en"));

it("speaks the page's language from its first picture on", async () => {
  const shown = async (language: string) => {
    await changeLanguage(language);
    return renderToString(<CarList path="/api/cars" image={null} program="" />);
  };
  expect(await shown("zh")).toContain("全部停下");
  expect(await shown("en")).toContain("Stop all");
});

describe("the cars of a class", () => {
  beforeEach(() => {
    vi.stubGlobal("WebSocket", Socket);
    // What asks why no connection opens.
    vi.stubGlobal("fetch", vi.fn(() => Promise.reject(new Error("no server"))));
  });
  afterEach(() => {
    cleanup();
    vi.unstubAllGlobals();
  });

  it("are loaded when they are ticked; all that answer are ticked at once", async () => {
    const user = userEvent.setup({ delay: null });
    render(<CarList path="/api/cars" image="AAAA" program="Parade" />);
    show(CARS);
    expect(screen.getByRole("button", { name: "Load ticked (0)" }).matches(":disabled")).toBe(true);
    await user.click(screen.getByRole("checkbox", { name: "All 2 that answer" }));
    await user.click(screen.getByRole("checkbox", { name: "Load Bo" }));
    await user.click(screen.getByRole("button", { name: "Load ticked (1)" }));
    expect(Socket.last.orders).toEqual([{ do: "load", where: ["a"], image: "AAAA", program: "Parade" }]);
  });

  it("say what their upload came to, and that the list is old once the connection is lost", () => {
    render(<CarList path="/api/cars" image="AAAA" program="Parade" />);
    show([{ ...CAR, sent: 3 }, { ...CARS[1]!, holds: "new" }, { ...CARS[2]!, holds: "away" }]);
    const said = ["Ada", "Bo", "Cy"].map((name) => row(name).getByRole("status").textContent.trim());
    expect(said).toEqual(["Loading…", "New program", "It could not be reached."]);
    act(() => Socket.last.close());
    expect(screen.getByText(/out of date/)).toBeTruthy();
  });

  it("all stop at once, and one that doesn't answer can't be asked to blink", async () => {
    const user = userEvent.setup({ delay: null });
    render(<CarList path="/api/cars" image={null} program="" />);
    show(CARS);
    await user.click(screen.getByRole("button", { name: "Let Bo blink" }));
    await user.click(screen.getByRole("button", { name: "Let Cy blink" }));
    await user.click(screen.getByRole("button", { name: "Stop all" }));
    expect(Socket.last.orders).toEqual([{ do: "blink", where: ["b"] }, { do: "stop" }]);
  });
});
