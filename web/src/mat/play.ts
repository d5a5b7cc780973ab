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

/** State, event, next state. An event that is not listed for a state changes nothing. */
export const TABLE: readonly (readonly [PlayState, PlayEvent, PlayState])[] = [
  ["nothing", "play", "due"],
  ["nothing", "stands", "standing"],
  ["nothing", "plays", "playing"],
  ["nothing", "past", "history"],
  ["nothing", "follow", "following"],
  ["due", "pause", "standing"],
  ["due", "open", "opened"],
  ["due", "follow", "following"],
  ["due", "plays", "playing"],
  ["due", "lost", "awayPlaying"],
  ["due", "taken", "takenPlaying"],
  ["standing", "play", "due"],
  ["standing", "open", "opened"],
  ["standing", "follow", "following"],
  ["standing", "plays", "playing"],
  ["standing", "past", "history"],
  ["standing", "over", "judged"],
  ["standing", "lost", "away"],
  ["standing", "taken", "taken"],
  ["playing", "pause", "standing"],
  ["playing", "open", "opened"],
  ["playing", "edit", "due"],
  ["playing", "follow", "following"],
  ["playing", "stands", "standing"],
  ["playing", "past", "history"],
  ["playing", "over", "judged"],
  ["playing", "lost", "awayPlaying"],
  ["playing", "taken", "takenPlaying"],
  ["history", "play", "due"],
  ["history", "open", "opened"],
  ["history", "edit", "standing"],
  ["history", "follow", "following"],
  ["history", "plays", "playing"],
  ["history", "stands", "standing"],
  ["history", "lost", "away"],
  ["history", "taken", "taken"],
  ["judged", "play", "due"],
  ["judged", "pause", "standing"],
  ["judged", "open", "opened"],
  ["judged", "edit", "standing"],
  ["judged", "follow", "following"],
  ["judged", "plays", "playing"],
  ["judged", "past", "history"],
  ["judged", "lost", "away"],
  ["judged", "taken", "taken"],
  ["opened", "play", "due"],
  ["opened", "follow", "following"],
  ["opened", "world", "standing"],
  ["opened", "lost", "away"],
  ["opened", "taken", "taken"],
  ["following", "play", "due"],
  ["following", "open", "opened"],
  ["following", "stands", "standing"],
  ["following", "past", "history"],
  ["away", "play", "awayPlaying"],
  ["away", "edit", "standing"],
  ["away", "follow", "following"],
  ["away", "plays", "playing"],
  ["away", "stands", "standing"],
  ["away", "past", "history"],
  ["away", "taken", "taken"],
  ["awayPlaying", "pause", "away"],
  ["awayPlaying", "open", "away"],
  ["awayPlaying", "edit", "due"],
  ["awayPlaying", "follow", "following"],
  ["awayPlaying", "plays", "playing"],
  ["awayPlaying", "stands", "standing"],
  ["awayPlaying", "past", "history"],
  ["awayPlaying", "taken", "takenPlaying"],
  ["taken", "play", "takenPlaying"],
  ["taken", "edit", "standing"],
  ["taken", "follow", "following"],
  ["taken", "plays", "playing"],
  ["taken", "stands", "standing"],
  ["taken", "past", "history"],
  ["takenPlaying", "pause", "taken"],
  ["takenPlaying", "open", "taken"],
  ["takenPlaying", "edit", "due"],
  ["takenPlaying", "follow", "following"],
  ["takenPlaying", "plays", "playing"],
  ["takenPlaying", "stands", "standing"],
  ["takenPlaying", "past", "history"],
];

/** The states in which the cars drive, or will as soon as they can. */
export const TO_PLAY: ReadonlySet<PlayState> = new Set(["due", "playing", "awayPlaying", "takenPlaying"]);

const NEXT = new Map(TABLE.map(([state, event, next]) => [`${state} ${event}`, next]));

/** The state after an event. */
export const stateAfter = (state: PlayState, event: PlayEvent): PlayState => NEXT.get(`${state} ${event}`) ?? state;
