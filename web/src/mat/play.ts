/**
 * Whether the cars drive, by one table of states.
 *
 * A state says what this page's world does and what its user wants. What the user does, what changes in the page and what the
 * world answers are events; TABLE says into which state each leads. A pair that TABLE doesn't list changes nothing, and
 * there is no other rule. A new world begins with each change of the program or of the cars' starts: it plays where the
 * state is one of TO_PLAY. Between the request and the answer the page is ahead of the world, whose answers may be about
 * the world before: so `due` waits for one that plays, and `opened` for the new world.
 */

export const STATES = {
  nothing: "no world yet; its cars stand when they come",
  due: "the cars drive as soon as there is a world with its program",
  standing: "the cars stand at the present",
  playing: "the cars drive",
  history: "a moment of the past is shown",
  judged: "the run has ended by itself: a mission's end, or what was to stop it",
  opened: "another project was opened, whose world isn't there yet; its cars stand",
  following: "the partner's page plays otherwise: the cars stand, then catch up",
  away: "the world can't be reached, and stood",
  awayPlaying: "the world can't be reached; its cars drive when it can",
  taken: "another window has the world, which stood",
  takenPlaying: "another window has the world, whose cars drive when it comes back",
} as const;
export type PlayState = keyof typeof STATES;

export const EVENTS = {
  play: "the user lets the cars drive",
  pause: "the user pauses, steps, begins again or looks at the past",
  open: "another project is opened",
  edit: "a new world is set: the program or the cars' starts have changed",
  follow: "the partner's page has played, paused, stepped or sought",
  world: "the new world is there",
  plays: "the world says that it plays",
  stands: "the world says that it stands",
  past: "the world says that it shows the past",
  over: "the world says why the run has ended",
  lost: "the connection is lost",
  taken: "another window takes the world",
} as const;
export type PlayEvent = keyof typeof EVENTS;

/** By state and event the next state. An event that is not listed for a state changes nothing. */
export const TABLE: Readonly<Record<PlayState, Partial<Record<PlayEvent, PlayState>>>> = {
  nothing: { play: "due", stands: "standing", plays: "playing", past: "history", follow: "following" },
  due: { pause: "standing", open: "opened", follow: "following", plays: "playing", lost: "awayPlaying", taken: "takenPlaying" },
  standing: { play: "due", open: "opened", follow: "following", plays: "playing", past: "history", over: "judged", lost: "away", taken: "taken" },
  playing: {
    pause: "standing",
    open: "opened",
    edit: "due",
    follow: "following",
    stands: "standing",
    past: "history",
    over: "judged",
    lost: "awayPlaying",
    taken: "takenPlaying",
  },
  history: { play: "due", open: "opened", edit: "standing", follow: "following", plays: "playing", stands: "standing", lost: "away", taken: "taken" },
  judged: {
    play: "due",
    pause: "standing",
    open: "opened",
    edit: "standing",
    follow: "following",
    plays: "playing",
    past: "history",
    lost: "away",
    taken: "taken",
  },
  opened: { play: "due", follow: "following", world: "standing", lost: "away", taken: "taken" },
  following: { play: "due", open: "opened", stands: "standing", past: "history" },
  away: { play: "awayPlaying", edit: "standing", follow: "following", plays: "playing", stands: "standing", past: "history", taken: "taken" },
  awayPlaying: { pause: "away", open: "away", edit: "due", follow: "following", plays: "playing", stands: "standing", past: "history", taken: "takenPlaying" },
  taken: { play: "takenPlaying", edit: "standing", follow: "following", plays: "playing", stands: "standing", past: "history" },
  takenPlaying: { pause: "taken", open: "taken", edit: "due", follow: "following", plays: "playing", stands: "standing", past: "history" },
};

/** The states in which the cars drive, or will as soon as they can. */
export const TO_PLAY: ReadonlySet<PlayState> = new Set(["due", "playing", "awayPlaying", "takenPlaying"]);

/** The state after an event. */
export const stateAfter = (state: PlayState, event: PlayEvent): PlayState => TABLE[state][event] ?? state;
