/** Messages between the page and its service. Written by scripts/generate.py; don't edit. */

/** A language's tag, such as en or zh. */
export type Language = string;

/** A text in every language that the service has. */
export interface Sentence {
  en: string;
  [language: Language]: string | undefined;
}

/** Blockly's `serialization.workspaces` state; the page reads it through Blockly alone. */
export type WorkspaceState = Record<string, unknown>;

/** A motorcade-mat/1 document. */
export interface MatDocument {
  format: "motorcade-mat/1";
  name: string;
  [key: string]: unknown;
}

/** A request without arguments, or an answer without content. */
export type Nothing = Record<string, never>;

/** What this shell can do beyond what every shell can; the page offers nothing else. */
export interface Capabilities {
  serial_ports: boolean;
  downloads: boolean;
  driving: boolean;
  most_cars: number;
  classroom: "" | "pupil" | "teacher";
  cars: string;
}

/** A profile, what people call such cars, and the durations that its steps can have. */
export interface ProfileFigures {
  name: string;
  durations_ms: number[];
  dwell_ms: number[];
  speeds_mm_s: number[];
  turn_rates_deg_s: number[];
  avoid_radii_mm: number[];
  title: Sentence;
  seconds: Seconds;
}

/** The durations that a step can have, in seconds: from ``least`` to ``most``, in steps of ``step``. */
export interface Seconds { least: number; step: number; most: number }

/** A move of a car that is measured: its key, its title, whether an angle is read, and the image that makes it. */
export interface CarMove { key: string; title: Sentence; turns: boolean; image: string }

/** What was read after moves, by their keys, as `readings_of` takes it: "88.5 3"; nothing for "". */
export interface CarReadings { readings: Record<string, string>; profile?: string }

/** What the readings say of the car; no car and no text until each move has one. */
export interface CarFigures { told: Sentence[]; car: MeasuredCar | null; text: string }

/** The figures of a car that was measured, as profiles have them: of each level, and of its wheels. */
export interface MeasuredCar {
  speeds_mm_s: number[];
  turn_rates_deg_s: number[];
  drift_mrad_per_m: number;
  stopping_ms: number;
}

/** The blocks in both editors, and the profile. */
export interface Blocks { leader: WorkspaceState; followers?: WorkspaceState | null; profile?: string }

/** What the page shows of a program; ``image`` is None where the program can't be compiled. */
export interface CompiledBlocks {
  diagnostics: Diagnostic[];
  image: string | null;
  dwell_ms: number;
  tagged: boolean;
  states: number;
  follower_words: number;
  most: number;
  costliest: Costs;
  words: Word[];
  left_out: string[];
  counters: string[];
}

/** An error or warning of a program; ``block`` is None where it concerns the whole editor. */
export interface Diagnostic {
  code: string;
  severity: "error" | "warning";
  sentence: Sentence;
  path: string;
  block: string | null;
  editor: "followers" | "leader" | null;
  place?: TextPlace | null;
  fixes?: Fix[];
}

/** A part of a text, from its first character to the one behind its last; lines and columns count from 1. */
export interface TextPlace { line: number; column: number; end_line: number; end_column: number }

/** A value or an edit that would fix what is wrong, and what a button says that does it. */
export interface Fix {
  field: string;
  value: number | number | string;
  sentence: Sentence;
  block: string | null;
  place: TextPlace | null;
}

/** The costliest block of each editor; None where an editor makes no words. */
export interface Costs { leader: Costliest | null; followers: Costliest | null }

/** The block that makes the most words. */
export interface Costliest { block: string | null; count: number }

/** A word, and the block that it was compiled from. */
export interface Word {
  hex: string;
  part: "followers" | "header" | "leader";
  block: string | null;
  fields_of?: Record<string, string>;
}

/** The page's project. */
export interface Project {
  leader: WorkspaceState;
  followers: WorkspaceState | null;
  profile: string;
  mat: MatDocument | null;
  range_mm: number | null;
  python: string | null;
  level: "python" | "start" | "words" | null;
  car: MeasuredCar | null;
}

/** The blocks in both editors, and the Python text beside them; an empty text where there is none yet. */
export interface BlocksAndText {
  leader: WorkspaceState;
  followers?: WorkspaceState | null;
  profile?: string;
  text?: string;
}

/** The Python text of the blocks. */
export interface PythonText { text: string; places: BlockPlace[]; diagnostics: Diagnostic[] }

/** Where a block stands in the Python text. */
export interface BlockPlace { line: number; column: number; end_line: number; end_column: number; block: string }

/** The blocks of a Python text; ``leader`` is None where the text can't be read. */
export interface PythonBlocks {
  leader: WorkspaceState | null;
  followers: WorkspaceState | null;
  profile: string;
  diagnostics: Diagnostic[];
}

/** Carry out the remedy that the answer to 'Why?' of a car names, on a project's mat, range and blocks. */
export interface RemedyOrder {
  mat: MatDocument;
  remedy: "forward" | "leader" | "listen" | "loss" | "move" | "range_mm" | "remove-car" | "remove-disc" | "remove-polygon" | "remove-wall";
  value: number;
  car: number;
  followers?: WorkspaceState | null;
  profile?: string;
  range_mm?: number | null;
}

/** What a remedy changes; what stays as it is is None or empty. All of it is so where there is no room for a car. */
export interface RemedyChanges { mat: MatDocument | null; range_mm: number | null; fields: FieldChange[] }

/** A new value for a field of one of the followers' blocks; ``block`` is None for the first one. */
export interface FieldChange { block: string | null; field: string; value: string }

/** The text of a project's file. */
export interface Text { text: string }

/** An example program, and what it shows. */
export interface Example { id: string; title: Sentence; about: Sentence; difficulty: 1 | 2 | 3 }

/** A mission in the map. */
export interface MissionEntry {
  id: string;
  name: Sentence;
  path: string;
  order: number;
  mat: MatDocument;
  zones: MissionZone[];
  stars: number[];
  earned: number[];
  minutes: number | null;
}

/** A zone: ``corners_m``, or a disc. ``name`` is its name in the file, ``title`` what people read. */
export interface MissionZone {
  name: string;
  title: Sentence;
  corners_m: number[][];
  centre_m: number[] | null;
  radius_m: number | null;
  avoid: boolean;
}

/** A mission: the id of one that comes with Motorcade, or the document of the user's own. */
export interface MissionChoice { id?: string; document?: Record<string, unknown> | null }

/** All that the page needs to play a mission. */
export interface Mission {
  id: string;
  name: Sentence;
  path: string;
  order: number;
  mat: MatDocument;
  zones: MissionZone[];
  story: Sentence;
  hints: Sentence[];
  learned: Sentence;
  level: string;
  steps: string[];
  goals: MissionGoal[];
  edits: string;
  seconds: number;
  seed: number;
  next: string;
  profile: string;
  leader: WorkspaceState;
  followers: WorkspaceState | null;
  earned: number[];
  document: Record<string, unknown>;
}

/** A goal, as the page tells it. */
export interface MissionGoal { kind: string; star: number; text: Sentence }

/** A mission for a teacher; what a mission without notes says nothing of is None. */
export interface MissionNotes {
  id: string;
  name: Sentence;
  path: string;
  order: number;
  mat: MatDocument;
  zones: MissionZone[];
  story: Sentence;
  hints: Sentence[];
  learned: Sentence;
  level: string;
  steps: string[];
  goals: MissionGoal[];
  minutes: number | null;
  aim: Sentence | null;
  say: Sentence | null;
  mistakes: NotedMistake[];
  further: Sentence | null;
}

/** A usual mistake, and the hint that helps. */
export interface NotedMistake { text: Sentence; hint: Sentence | null }

/** The blocks that a mission is to be checked with. */
export interface MissionAttempt { mission: MissionChoice; leader: WorkspaceState; followers?: WorkspaceState | null }

/** What a program earned, and all that the user has earned. */
export interface MissionResult {
  stars: number[];
  earned: number[];
  goals: CheckedGoal[];
  steps: Sentence | null;
  mistake: Sentence | null;
}

/** The result of a goal on all seeds: met, or why it was lost on the first seed on which it was. */
export interface CheckedGoal {
  kind: string;
  star: number;
  met: boolean;
  seed: number;
  t_ms: number;
  why: Sentence;
  cars: number[];
}

/** A project of the library: when it was last saved (ISO 8601, UTC), and how many versions there are. */
export interface LibraryEntry { name: string; saved_at: string; versions: number }

/** The number of the version that holds what was saved, and whether it stays when the page is closed. */
export interface SavedVersion { version: number; stays: boolean }

/** A port to upload through; ``kind`` is serial or virtual. */
export interface Port { port: string; description: string; kind: "serial" | "virtual" }

/** A project, its name in the library, and the version that it is. */
export interface StoredProject {
  leader: WorkspaceState;
  followers: WorkspaceState | null;
  profile: string;
  mat: MatDocument | null;
  range_mm: number | null;
  python: string | null;
  level: "python" | "start" | "words" | null;
  car: MeasuredCar | null;
  name: string;
  version: number;
}

/** A version of a project, and when it was saved (ISO 8601, UTC). */
export interface Version { version: number; saved_at: string }

/** Where projects are stored: whether they stay when the page is closed, and what is wrong with them. */
export interface StorageState { stays: boolean; problems: ErrorAnswer[] }

/** Why a request was refused, by `motorcade.errors.MotorcadeError.to_dict`; a program also has diagnostics. */
export interface ErrorAnswer {
  code: string;
  details: Record<string, unknown>;
  sentence: Sentence;
  diagnostics?: Diagnostic[];
}

/** The text of the file, and the versions that aren't in it. */
export interface Exported { text: string; left_out: LeftOut[] }

/** A version of a project that couldn't be read. */
export interface LeftOut { name: string; version: number }

/** What an import did. */
export interface Imported { projects: ImportedProject[]; stars: number; left_out: string[] }

/** A project of the file: the name under which it is stored, and how many versions were added. */
export interface ImportedProject { name: string; stored_as: string; versions: number }

/** Blink or load the cars at some ports and addresses, or stop all cars, or let all go. */
export interface CarsOrder {
  do: "blink" | "go" | "load" | "stop";
  where?: string[];
  image?: string | null;
  program?: string;
}

/** Build a world; without an image no car has a program. */
export interface SetWorld {
  do: "set";
  mat: MatDocument;
  image?: string | null;
  profile?: string;
  seed?: number;
  range_mm?: number | null;
  mission?: MissionChoice | null;
  counters?: string[];
  car?: MeasuredCar | null;
}

/** Go on, ``speed`` simulated seconds in a real one. */
export interface Play { do: "play"; speed?: number }

/** Pause the world. */
export interface Pause { do: "pause" }

/** Go on by so many ticks. */
export interface StepWorld { do: "step"; ticks?: number }

/** Begin again; with ``until_ms`` the run is simulated until then at once. */
export interface Reset { do: "reset"; seed?: number; until_ms?: number }

/** Stop as soon as one of these happens; they replace those before, and end with the world. */
export interface StopWhen { do: "stop-when"; conditions: StopCondition[] }

/** Something that may happen to a car. */
export interface StopCondition {
  kind: "block" | "condition" | "lost" | "stuck" | "touch" | "zone";
  car?: number | null;
  thing?: "" | "car" | "disc" | "edge" | "polygon" | "wall";
  number?: number | null;
  corners_m?: number[][];
  disc?: number[];
  name?: string;
  words?: number[];
}

/** Speak a word that all cars hear. */
export interface Speak { do: "say"; word: "go" | "stop" }

/** Change what is around the cars. */
export interface SetEnvironment { do: "set_environment"; mat: MatDocument; range_mm?: number | null }

/** Put a car elsewhere. */
export interface Move { do: "move"; car: number; x_m: number; y_m: number; heading_deg?: number }

/** Send the details of a car, or of none. */
export interface Watch { do: "watch"; car?: number | null }

/** Show a moment of the past, or the present. */
export interface Seek { do: "seek"; t_ms?: number | null }

/** Give a car that somebody drove back to its program. */
export interface Resume { do: "resume"; car: number }

/** The newest picture that the page has drawn. */
export interface Shown { do: "shown"; frame: number }

/** The first answer of a connection, and after each SetWorld; without a world it has three fields only. */
export interface WorldHello {
  is: "hello";
  session: string;
  resumed: boolean;
  cars: number;
  leads?: number[];
  tick_ms?: number;
  radius_m?: number;
  range_m?: number;
}

/** How time passes. */
export interface State {
  is: "state";
  playing: boolean;
  speed: number;
  t_ms: number;
  shown_ms: number | null;
  earliest_ms: number;
  seed: number;
  counts: Record<string, number>;
  rate: number;
  driven: number[];
}

/** The details of the watched car: the word that it executes or holds, and its counts since the beginning. */
export interface CarDetails {
  is: "car";
  car: number;
  leads: boolean;
  word: string | null;
  values: Record<string, number> | null;
  index: number;
  runs: boolean;
  frames: number;
  heard: number;
  lost: Record<string, number>;
  last_frame: ReceivedFrame | null;
  why: Why;
}

/** A frame: its control word, its tag and check (0: bare), the car that sent it, and when it was received. */
export interface ReceivedFrame { word: string; tag: number; check: number; car: number; t_ms: number }

/** Why a car does what it does, and what would change it. */
export interface Why {
  code: string;
  sentence: Sentence;
  car: number | null;
  remedy: "forward" | "leader" | "listen" | "loss" | "move" | "range_mm" | "remove-car" | "remove-disc" | "remove-polygon" | "remove-wall" | "" | "followers";
  value: number;
}

/** What cars think at the shown time, the most telling thoughts first; the others think nothing. */
export interface Thoughts { is: "thoughts"; thoughts: CarThought[] }

/** What a car thinks: the short form of its answer to 'Why?'. */
export interface CarThought {
  car: number;
  thought: "blocked" | "blockedByCar" | "collisions" | "damaged" | "deaf" | "hidden" | "noLine" | "noProgram" | "notPassedOn" | "nothing" | "outsideBeam" | "tooFar" | "waiting";
}

/** What the leaders that decide have come to at the shown time. */
export interface Decisions { is: "decisions"; leaders: Decided[] }

/** What a leader that decides has come to. */
export interface Decided { car: number; counters: number[]; holds: number[]; path: number[] }

/** The goals of the mission at the shown time, in its order; ``is_over``: the run has ended. */
export interface Goals { is: "goals"; is_over: boolean; goals: GoalNow[] }

/** How it stands with a goal of the mission, and why, with numbers. */
export interface GoalNow {
  progress: "holds" | "lost" | "met" | "open";
  t_ms: number | null;
  why: Sentence;
  cars: number[];
}

/** The world has stopped: ``condition``, an index into those of StopWhen, began to hold for a car. */
export interface Stopped {
  is: "stopped";
  t_ms: number;
  condition: number;
  car: number;
  others: number[];
  why: Sentence;
}

/** The error of a message that was refused. */
export interface Refused { is: "error"; code: string; details: Record<string, unknown>; sentence: Sentence }

/** The car holds the image; ``answer`` is what it answered. */
export interface Verified { outcome: "verified"; answer: string }

/** All bytes were sent; whether they arrived was not checked. */
export interface NotVerified { outcome: "not-verified" }

/** The car's image. */
export interface ImageRead { outcome: "image"; image: string }

/** The transfer failed. */
export interface Failed { outcome: "failed"; error: ErrorAnswer }

/** How many bytes of how many were sent. */
export interface Progress { sent: number; of: number; retry?: RetryNotice | null }

/** Another try, the ``number``-th of ``of``, and why. */
export interface RetryNotice { number: number; of: number; sentence: Sentence }

/** All cars that are found; ``others``: classes and studios; ``problem``: why the network isn't searched. */
export interface CarsShown { is: "cars"; cars: CarRow[]; others: string[]; problem: Sentence | null }

/** What is known of a car, as `motorcade.fleet.contact.CarStatus` has it. */
export interface CarRow {
  name: string;
  where: string;
  kind: string;
  number: number | null;
  role: string;
  board: string;
  version: string;
  state: string;
  words: number | null;
  crc32: string | null;
  battery_mv: number | null;
  away: boolean;
  silent_s: number | null;
  program: string;
  problem: Sentence | null;
  sent: number | null;
  holds: string;
  error: Sentence | null;
}

/** Run a mission on its own seeds, then on others, with this image; what was tried before ends. */
export interface Try { do: "try"; mission: MissionChoice; image: string; runs?: number }

/** Say what went wrong in a run that was tried. */
export interface Explain { do: "explain"; seed: number }

/** Find where two runs part; what was compared before ends. */
export interface Compare { do: "compare"; one: SetWorld; other: SetWorld; until_ms?: number }

/** Send a picture of each of the two runs at a time. */
export interface Show { do: "show"; t_ms: number }

/** In how many runs the goals of the first star were met. */
export interface Luck {
  is: "luck";
  works: number;
  tried: number;
  of: number;
  failed: number[];
  stars: number[] | null;
}

/** What went wrong in a run: at ``t_ms`` one can see it, and ``cars`` are the cars that ``why`` is about. */
export interface Failure { is: "failure"; seed: number; t_ms: number; why: Sentence; cars: number[] }

/** Where two runs part. */
export interface Difference {
  is: "difference";
  kind: "none" | "place" | "word";
  t_ms: number;
  car: number;
  exact_ms: number | null;
  exact_car: number | null;
  missed: number | null;
  late_ms: number | null;
  words: (string | null)[];
  cause: Sentence | null;
  begun: BegunWord[][];
}

/** A word that a car began, as eight hexadecimal digits. */
export interface BegunWord { t_ms: number; word: string }

/** How far two runs are simulated. */
export interface Compared { is: "compared"; t_ms: number }

export type WorldMessage = SetWorld | Play | Pause | StepWorld | Reset | StopWhen | Speak | SetEnvironment | Move | Watch | Seek | Resume | Shown;

export type WorldAnswer = WorldHello | State | CarDetails | Thoughts | Decisions | Goals | Stopped | Refused;

export type Outcome = Verified | NotVerified | ImageRead | Failed;

export type UploadAnswer = Progress | Verified | NotVerified | ImageRead | Failed;

export type CarsAnswer = CarsShown | Refused;

export type TrialMessage = Try | Explain | Compare | Show;

export type TrialAnswer = Luck | Failure | Difference | Compared | Refused;

/** Every request: `POST /api/<name>` with its message gives its answer. */
export interface Requests {
  "capabilities": { message: Nothing; answer: Capabilities };
  "profiles": { message: Nothing; answer: ProfileFigures[] };
  "calibration/moves": { message: { profile?: string }; answer: CarMove[] };
  "calibration/fit": { message: CarReadings; answer: CarFigures };
  "compile": { message: Blocks; answer: CompiledBlocks };
  "decompile": { message: { image: string }; answer: Project };
  "blocks-to-python": { message: BlocksAndText; answer: PythonText };
  "python-to-blocks": { message: BlocksAndText; answer: PythonBlocks };
  "remedy": { message: RemedyOrder; answer: RemedyChanges };
  "open": { message: { text: string }; answer: Project };
  "save-text": { message: Project; answer: Text };
  "mats/open": { message: { text: string; name: string }; answer: MatDocument };
  "opening": { message: Nothing; answer: Project };
  "examples": { message: Nothing; answer: Example[] };
  "example": { message: { name: string }; answer: Project };
  "missions": { message: Nothing; answer: MissionEntry[] };
  "mission": { message: MissionChoice; answer: Mission };
  "missions/notes": { message: MissionChoice; answer: MissionNotes };
  "missions/open": { message: { text: string }; answer: Mission };
  "missions/save-text": { message: MissionChoice; answer: Text };
  "missions/check": { message: MissionAttempt; answer: MissionResult };
  "missions/own": { message: Nothing; answer: LibraryEntry[] };
  "missions/read": { message: { name: string }; answer: Mission };
  "missions/write": { message: { name: string; document: Record<string, unknown> }; answer: SavedVersion };
  "missions/delete": { message: { name: string }; answer: Nothing };
  "event-table": { message: { rows: string }; answer: Text };
  "ports": { message: Nothing; answer: Port[] };
  "projects/list": { message: Nothing; answer: LibraryEntry[] };
  "projects/read": { message: { name: string; version?: number | null }; answer: StoredProject };
  "projects/write": { message: { name: string; project: Project; base?: number | null }; answer: SavedVersion };
  "projects/history": { message: { name: string }; answer: Version[] };
  "projects/delete": { message: { name: string }; answer: Nothing };
  "projects/place": { message: Nothing; answer: StorageState };
  "projects/export": { message: Nothing; answer: Exported };
  "projects/import": { message: { text: string }; answer: Imported };
}
