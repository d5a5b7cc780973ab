/** Messages of a class's pages and the server. Written by scripts/generate.py; don't edit. */

import type { LibraryEntry, MatDocument, Mission, MissionChoice, MissionGoal, MissionZone, Nothing, Project, Refused, Sentence, StoredProject } from "./messages";

/** How many files are checked for one report, and how many bytes they have at most. */
export const MOST_FILES = 1000;
export const MOST_BYTES = 33554432;

/** Another pupil, to whom a copy of a project can be given. */
export interface Classmate { id: string; name: string; avatar: string }

/** What everybody may know before joining. */
export interface ClassAbout { me: Self | null; is_open: boolean; avatars: string[]; title: string }

/** The pupil whose page asks; ``number`` is the personal one, of four digits, for coming back. */
export interface Self { id: string; name: string; avatar: string; number: string }

/** The draft; ``project`` is None where there is none, ``saved_at`` is ISO 8601 in UTC; the others as in `Draft`. */
export interface StoredDraft {
  name: string;
  project: Project | null;
  saved_at: string;
  place: string;
  mission: MissionChoice | null;
}

/** What a window holds, and its version: 0 while nothing was stored. */
export interface PairProject { project: Project; version: number; mission?: MissionChoice | null }

/** Whether a password has been set, and whether this browser is signed in. */
export interface TeacherAbout { has_password: boolean; signed_in: boolean }

/** How pupils find the class. */
export interface ClassAddresses {
  code: string;
  addresses: string[];
  local_name: string | null;
  why_no_name: Sentence | null;
  qr_code: string;
}

/** To how many pupils it was given; ``missed`` has the ids of those whose library takes nothing more. */
export interface HandedOut { pupils: number; missed: string[] }

/** A pupil's projects. */
export interface PupilLibrary { pupil: string; projects: LibraryEntry[]; draft_at: string | null }

/** The missions, path by path and in order, and by pupil the stars that were earned, of each mission's id. */
export interface ClassProgress { missions: MissionStars[]; stars: Record<string, Record<string, number[]>> }

/** A mission, and the stars that it has. */
export interface MissionStars { id: string; name: Sentence; stars: number[] }

/** All that concerns a pupil; sent whole when something has changed. */
export interface PupilView {
  is: "pupil";
  frozen: boolean;
  shared: Shared[];
  stopped: boolean;
  cabled: boolean;
  mat: MatView;
  me: Self;
  hand: boolean;
  mission: number | null;
  news: News[];
  pair: PairView | null;
}

/** What one pupil at a time may use: the cable, whose name is "", or a real car; ``holder`` None: nobody does. */
export interface Shared { name: string; holder: string | null }

/** The shared mat. */
export interface MatView {
  state: "closed" | "collecting" | "over" | "running";
  mission: string | null;
  title: Sentence;
  places: number;
  entries: string[];
}

/** What came to a pupil: a project, or a mission in each language, and whose it was ("" for the teacher's). */
export interface News { number: number; kind: "mission" | "project"; name: string | Sentence; sender: string }

/** A pair, for one of its pupils. */
export interface PairView {
  id: string;
  name: string;
  partner: Classmate | null;
  joined: boolean;
  partner_joined: boolean;
  partner_away: boolean;
  owners: Record<string, string | null>;
  versions: Record<string, number>;
  asks: string | null;
  conducted: Conducted | null;
}

/** How the worlds of a pair's pages are played: what one of them did last. */
export interface Conducted {
  number: number;
  by: string;
  playing: boolean;
  speed: number;
  seed: number;
  t_ms: number;
  age_ms: number;
}

/** The pupil is no longer in the class; the connection ends. ``left``: on another page of this device. */
export interface Goodbye { is: "goodbye"; why: "ended" | "left" | "removed" }

/** The whole class, for the teacher; sent whole when something has changed. */
export interface ClassView {
  is: "class";
  frozen: boolean;
  shared: Shared[];
  stopped: boolean;
  cabled: boolean;
  mat: MatView;
  title: string;
  code: string;
  is_open: boolean;
  stuck_minutes: number;
  pupils: PupilRow[];
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
}

/** The worlds on the wall; sent whole when one is new or changed. Pictures refer to their places in this list. */
export interface ClassWall { is: "wall"; number: number; worlds: WallWorld[] }

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

export type ClassAnswer = PupilView | Goodbye | Refused;

export type TeacherAnswer = ClassView | Goodbye | Refused;

export type WallAnswer = ClassWall | Refused;

/** The requests of pupils: `POST /api/class/<name>`. */
export interface PupilRequests {
  "check-code": { message: { code: string }; answer: Nothing };
  "seen": { message: { number: number }; answer: Nothing };
  "classmates": { message: Nothing; answer: Classmate[] };
  "hand": { message: { raised: boolean }; answer: Nothing };
  "take": { message: { name: string; wants: boolean }; answer: Nothing };
  "pair/take": { message: { window: "followers" | "leader"; wants: boolean }; answer: Nothing };
  "pair/join": { message: Nothing; answer: Nothing };
  "pair/swap": { message: { wants: boolean }; answer: Nothing };
  "pair/conduct": { message: { playing: boolean; speed: number; seed: number; t_ms: number }; answer: Nothing };
  "about": { message: Nothing; answer: ClassAbout };
  "join": { message: { code: string; name: string; avatar: string }; answer: Self };
  "return": { message: { code: string; name: string; number: string }; answer: Self };
  "leave": { message: Nothing; answer: Nothing };
  "draft/read": { message: Nothing; answer: StoredDraft };
  "draft/write": { message: { name: string; project: Project; place?: string; mission?: MissionChoice | null }; answer: Nothing };
  "give": { message: { to: string; name: string }; answer: string };
  "mission": { message: { number: number }; answer: Mission };
  "mat": { message: { image: string | null }; answer: Nothing };
  "pair/begin": { message: { to: string; name: string; project: Project; mission?: MissionChoice | null }; answer: Nothing };
  "pair/open": { message: { pair: string; name: string; project: Project; mission: MissionChoice }; answer: Nothing };
  "pair/read": { message: { window: "followers" | "leader" }; answer: PairProject };
  "pair/write": { message: { pair: string; window: "followers" | "leader"; project: Project; base: number }; answer: number };
  "pair/leave": { message: Nothing; answer: string };
}

/** The requests of the teacher: `POST /api/teacher/<name>`. */
export interface TeacherRequests {
  "settings": { message: { title?: string | null; is_open?: boolean | null; stuck_minutes?: number | null }; answer: Nothing };
  "rename": { message: { pupil: string; name: string }; answer: Nothing };
  "reset-number": { message: { pupil: string }; answer: Self };
  "lower-hand": { message: { pupil: string }; answer: Nothing };
  "pass-on": { message: { name: string; pupil: string | null }; answer: Nothing };
  "mat/open": { message: { mission?: MissionChoice | null; followers?: number; places?: number }; answer: Nothing };
  "mat/start": { message: Nothing; answer: Nothing };
  "mat/close": { message: Nothing; answer: Nothing };
  "about": { message: Nothing; answer: TeacherAbout };
  "first-password": { message: { key: string; password: string }; answer: Nothing };
  "sign-in": { message: { password: string }; answer: Nothing };
  "sign-out": { message: Nothing; answer: Nothing };
  "addresses": { message: Nothing; answer: ClassAddresses };
  "choose-address": { message: { address: string }; answer: ClassAddresses };
  "new-code": { message: Nothing; answer: ClassAddresses };
  "freeze": { message: { frozen: boolean }; answer: Nothing };
  "remove": { message: { pupil: string }; answer: Nothing };
  "hand-out": { message: { to?: string[] | null; name?: string; project?: Project | null; mission?: MissionChoice | null }; answer: HandedOut };
  "library": { message: { pupil: string }; answer: PupilLibrary };
  "project": { message: { pupil: string; name: string }; answer: StoredProject };
  "progress": { message: Nothing; answer: ClassProgress };
  "stop-all": { message: Nothing; answer: string[] };
  "release-all": { message: Nothing; answer: Nothing };
  "end": { message: { password: string }; answer: Nothing };
}
