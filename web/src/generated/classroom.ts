/** Messages of a class's pages and the server. Written by scripts/generate.py; don't edit. */

import type { LibraryEntry, MatDocument, Mission, MissionChoice, MissionGoal, MissionZone, Nothing, Project, Sentence, StoredProject } from "./messages";

/** What everybody may know before joining. */
export interface ClassAbout {
  me: Self | null;
  teacher: boolean;
  is_open: boolean;
  avatars: string[];
  title: string;
}

/** The pupil whose page asks; ``number`` is the personal one, of four digits, for coming back. */
export interface Self {
  id: string;
  name: string;
  avatar: string;
  number: string;
}

/** The code of the class, as somebody typed it; spaces, dashes and small letters don't matter. */
export interface ClassCode {
  code: string;
}

/** A newcomer: the code of the class, the nickname, and one of the avatars. */
export interface Joining {
  code: string;
  name: string;
  avatar: string;
}

/** A pupil who comes back at another device, with the personal number. */
export interface Returning {
  code: string;
  name: string;
  number: string;
}

/** Raise the hand, or lower it. */
export interface Hand {
  raised: boolean;
}

/** The pupil has seen the news up to this number. */
export interface Seen {
  number: number;
}

/** The draft; ``project`` is None where there is none, ``saved_at`` is ISO 8601 in UTC. */
export interface StoredDraft {
  name: string;
  project: Project | null;
  saved_at: string;
}

/** What a pupil works on, under which name: stored beside the projects, without versions. */
export interface Draft {
  name: string;
  project: Project;
}

/** Another pupil, to whom a copy of a project can be given. */
export interface Classmate {
  id: string;
  name: string;
  avatar: string;
}

/** Give a classmate a copy of an own project. */
export interface Gift {
  to: string;
  name: string;
}

/** The name of the copy in the other's shelf. */
export interface Copied {
  name: string;
}

/** The number of a mission that was handed out, as in `PupilView.mission`. */
export interface HandedMission {
  number: number;
}

/** Stand in the queue for the cable, or leave it. */
export interface CableWish {
  wants: boolean;
}

/** Stand in the queue to drive a real car, or leave it. */
export interface TurnWish {
  car: string;
  wants: boolean;
}

/** The program for the shared mat; None takes the own cars off it. */
export interface MatEntry {
  image: string | null;
}

/** Whether a password has been set, and whether this browser is signed in. */
export interface DeskAbout {
  has_password: boolean;
  signed_in: boolean;
}

/** Set the password; ``key`` stands behind ``/desk#`` in the address that the command prints. */
export interface FirstPassword {
  key: string;
  password: string;
}

/** The teacher's password. */
export interface Password {
  password: string;
}

/** How pupils find the class. */
export interface ClassAddresses {
  code: string;
  addresses: string[];
  local_name: string | null;
  why_no_name: Sentence | null;
  qr_code: string;
}

/** The address that tablets reach: the QR code is to lead there. */
export interface ChosenAddress {
  address: string;
}

/** Settings of the class; None leaves one as it is. */
export interface ClassSettings {
  title?: string | null;
  is_open?: boolean | null;
  stuck_minutes?: number | null;
  turn_s?: number | null;
}

/** Freeze all pupils' pages, or thaw them. */
export interface Frozen {
  frozen: boolean;
}

/** A pupil. */
export interface PupilId {
  pupil: string;
}

/** Give a pupil another nickname. */
export interface Renaming {
  pupil: string;
  name: string;
}

/** Give pupils a project, or a mission. The project is one of the teacher's own shelf, or comes with the message. */
export interface HandOut {
  to?: string[] | null;
  name?: string;
  project?: Project | null;
  mission?: MissionChoice | null;
}

/** To how many pupils it was given; ``missed`` has the ids of those whose shelf takes nothing more. */
export interface HandedOut {
  pupils: number;
  missed: string[];
}

/** A pupil's projects. */
export interface PupilShelf {
  pupil: string;
  projects: LibraryEntry[];
  draft_at: string | null;
}

/** A project in a pupil's shelf; an empty name for the draft. */
export interface PupilProject {
  pupil: string;
  name: string;
}

/** The missions, path by path and in order, and what each pupil has earned. */
export interface ClassProgress {
  missions: MissionStars[];
  pupils: PupilStars[];
}

/** A mission, and the stars that it has. */
export interface MissionStars {
  id: string;
  name: Sentence;
  stars: number[];
}

/** The stars that a pupil has earned, of each mission's id. */
export interface PupilStars {
  pupil: string;
  stars: Record<string, number[]>;
}

/** The real cars that could not be reached; those stop by themselves when their driver is silent. */
export interface StoppedAll {
  missed: string[];
}

/** Open the shared mat: of a mission with many leaders, or None for a parade with one for each program. */
export interface OpenMat {
  mission?: MissionChoice | null;
  followers?: number;
  places?: number;
}

/** All that concerns a pupil; sent whole when something has changed. */
export interface PupilView {
  is: "pupil";
  me: Self;
  hand: boolean;
  frozen: boolean;
  cable: number | null;
  cable_use: "ending" | "free" | "sends";
  turns: CarTurn[];
  stopped: boolean;
  mat: MatView;
  mission: number | null;
  news: News[];
}

/** The queue for driving one real car: who drives, for how many more seconds, and who waits, in order. */
export interface CarTurn {
  car: string;
  driver: string | null;
  left_s: number;
  waiting: string[];
}

/** The shared mat. */
export interface MatView {
  state: "closed" | "collecting" | "over" | "running";
  mission: string | null;
  title: Sentence;
  places: number;
  entries: string[];
}

/** Something that came to a pupil: a project in the shelf, or a mission, and whose it was ("" for the teacher's). */
export interface News {
  number: number;
  kind: "mission" | "project";
  name: string;
  sender: string;
}

/** The pupil is no longer in the class; the connection ends. ``left``: on another page of this device. */
export interface Goodbye {
  is: "goodbye";
  why: "ended" | "left" | "removed";
}

/** Why the connection ends. */
export interface ClassRefused {
  is: "error";
  code: string;
  details: Record<string, unknown>;
  sentence: Sentence;
}

/** The whole class, for the teacher's desk; sent whole when something has changed. */
export interface ClassView {
  is: "class";
  title: string;
  code: string;
  is_open: boolean;
  frozen: boolean;
  stuck_minutes: number;
  turn_s: number;
  pupils: PupilRow[];
  cable: string[];
  cable_use: "ending" | "free" | "sends";
  turns: CarTurn[];
  stopped: boolean;
  mat: MatView;
  disk: Sentence | null;
}

/** A pupil, as the teacher sees it; all times in seconds until now. */
export interface PupilRow {
  id: string;
  name: string;
  avatar: string;
  number: string;
  online: boolean;
  away_s: number;
  hand_s: number | null;
  stuck_s: number | null;
  mission: string | null;
  goals_met: number;
  goals: number;
  stars: number;
  wrong_numbers: number;
}

/** The worlds on the wall; sent whole when one is new or furnished. Pictures refer to their places in this list. */
export interface Wall {
  is: "wall";
  number: number;
  worlds: WallWorld[];
}

/** A world on the wall: its mat, its leaders, and the radius of its cars; ``pupil`` is "" for the shared mat. */
export interface WallWorld {
  pupil: string;
  mat: MatDocument;
  leads: number[];
  radius_m: number;
  cars: number;
  zones: MissionZone[];
  goals: MissionGoal[];
}

/** The page has drawn the last picture of the wall, and wants the next. */
export type DrawnWall = Record<string, never>;

export type ClassAnswer = PupilView | Goodbye | ClassRefused;

export type DeskAnswer = ClassView | Goodbye | ClassRefused;

export type WallAnswer = Wall | ClassRefused;

/** The requests of pupils: `POST /api/class/<name>`. */
export interface PupilRequests {
  "about": { message: Nothing; answer: ClassAbout };
  "check-code": { message: ClassCode; answer: Nothing };
  "join": { message: Joining; answer: Self };
  "return": { message: Returning; answer: Self };
  "leave": { message: Nothing; answer: Nothing };
  "hand": { message: Hand; answer: Nothing };
  "seen": { message: Seen; answer: Nothing };
  "draft/read": { message: Nothing; answer: StoredDraft };
  "draft/write": { message: Draft; answer: Nothing };
  "classmates": { message: Nothing; answer: Classmate[] };
  "give": { message: Gift; answer: Copied };
  "mission": { message: HandedMission; answer: Mission };
  "cable": { message: CableWish; answer: Nothing };
  "turn": { message: TurnWish; answer: Nothing };
  "mat": { message: MatEntry; answer: Nothing };
}

/** The requests of the teacher: `POST /api/desk/<name>`. */
export interface DeskRequests {
  "about": { message: Nothing; answer: DeskAbout };
  "first-password": { message: FirstPassword; answer: Nothing };
  "sign-in": { message: Password; answer: Nothing };
  "sign-out": { message: Nothing; answer: Nothing };
  "addresses": { message: Nothing; answer: ClassAddresses };
  "choose-address": { message: ChosenAddress; answer: ClassAddresses };
  "new-code": { message: Nothing; answer: ClassAddresses };
  "settings": { message: ClassSettings; answer: Nothing };
  "freeze": { message: Frozen; answer: Nothing };
  "lower-hand": { message: PupilId; answer: Nothing };
  "rename": { message: Renaming; answer: Nothing };
  "reset-number": { message: PupilId; answer: Self };
  "remove": { message: PupilId; answer: Nothing };
  "hand-out": { message: HandOut; answer: HandedOut };
  "shelf": { message: PupilId; answer: PupilShelf };
  "project": { message: PupilProject; answer: StoredProject };
  "progress": { message: Nothing; answer: ClassProgress };
  "cable/next": { message: Nothing; answer: Nothing };
  "turn/next": { message: TurnWish; answer: Nothing };
  "stop-all": { message: Nothing; answer: StoppedAll };
  "release-all": { message: Nothing; answer: Nothing };
  "mat/open": { message: OpenMat; answer: Nothing };
  "mat/start": { message: Nothing; answer: Nothing };
  "mat/close": { message: Nothing; answer: Nothing };
  "end": { message: Password; answer: Nothing };
}
