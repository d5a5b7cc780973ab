import { expect, it } from "vitest";
import { EVENTS, type PlayEvent, type PlayState, STATES, stateAfter, TABLE, TO_PLAY } from "./play";

const ALL_STATES = Object.keys(STATES) as PlayState[];
const ALL_EVENTS = Object.keys(EVENTS) as PlayEvent[];
const USER: readonly PlayEvent[] = ["play", "pause", "open", "follow"];

const after = (state: PlayState, ...events: PlayEvent[]) => events.reduce(stateAfter, state);
/** Whether the cars drive, or are to, after each of these events, whatever the state was. */
const toPlay = (event: PlayEvent) => [...new Set(ALL_STATES.map((state) => TO_PLAY.has(stateAfter(state, event))))];

it("each pair of the table changes the state", () => {
  for (const state of ALL_STATES) expect(Object.values(TABLE[state])).not.toContain(state);
});

it("each state is reached from the beginning, and leads back to one that stands and one that plays", () => {
  const reached = new Set<PlayState>(["nothing"]);
  for (const state of reached) for (const event of ALL_EVENTS) reached.add(stateAfter(state, event));
  expect([...reached].sort()).toEqual([...ALL_STATES].sort());
  for (const state of ALL_STATES) {
    expect(after(state, "play", "edit", "plays")).toBe("playing");
    expect(["standing", "opened", "judged"]).toContain(after(state, "pause", "open", "edit", "world", "stands"));
  }
});

it("who lets the cars drive sees them drive, and who pauses or opens another project sees them stand", () => {
  expect(toPlay("play")).toEqual([true]);
  for (const event of ["pause", "open", "follow"] as const) expect(toPlay(event)).toEqual([false]);
});

it("an edit, a lost connection and another window change nothing of whether the cars are to drive", () => {
  for (const event of ["edit", "lost", "taken"] as const) {
    for (const state of ALL_STATES) expect([state, TO_PLAY.has(stateAfter(state, event))]).toEqual([state, TO_PLAY.has(state)]);
  }
});

it("until the world of another project is there, whatever the world before says lets no car drive", () => {
  const told = ALL_EVENTS.filter((event) => !USER.includes(event) && event !== "world" && event !== "lost" && event !== "taken");
  for (const first of told) for (const second of told) expect(after("playing", "open", first, second)).toBe("opened");
  expect(after("playing", "open", "stands", "edit", "world", "stands")).toBe("standing");
});

it("who waits for the cars isn't stopped by what the world before says", () => {
  for (const event of ["stands", "past", "over", "world", "edit"] as const) expect(stateAfter("due", event)).toBe("due");
});

it("a run that has ended stays so until somebody plays, begins again, edits or looks at the past", () => {
  expect(after("playing", "stands", "over", "stands", "world")).toBe("judged");
  expect(after("judged", "past", "stands", "over")).toBe("judged");
});
