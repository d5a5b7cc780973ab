/** What is shown above the page: a dialog, and notices. */

import { create } from "zustand";
import { type Studio, useStudio } from "./studio";

export type DialogName = "upload" | "calibration" | "library" | "examples" | "share" | "missions" | "notes" | "run" | "help";
type Tone = "info" | "success" | "warning" | "error";

interface Notice {
  id: number;
  text: string;
  tone: Tone;
  action?: { label: string; run: () => void };
  /** Whether its cause is still there; it goes with its cause. */
  holds?: (now: Studio) => boolean;
}

interface Dialogs {
  open: DialogName | null;
  /** The mission whose notes are shown; null for the first one's. */
  notesOf: string | null;
  notices: Notice[];
}

export const useDialogs = create<Dialogs>(() => ({ open: null, notesOf: null, notices: [] }));

export function openDialog(open: DialogName | null): void {
  useDialogs.setState({ open });
}

export const closeDialog = () => openDialog(null);

/** Show the notes of a mission, by its id. */
export function openNotes(notesOf: string | null): void {
  useDialogs.setState({ open: "notes", notesOf });
}

const SHOWN_MS = 8000;
let lastId = 0;

/**
 * Show a notice, which screen readers read out. An error stays until it is dismissed, others go by themselves; all go once
 * their cause no longer `holds`.
 */
export function notify(text: string, tone: Tone = "info", action?: Notice["action"], holds?: Notice["holds"]): void {
  const id = ++lastId;
  const others = useDialogs.getState().notices.filter((notice) => notice.text !== text);
  useDialogs.setState({ notices: [...others.slice(-2), { id, text, tone, action, holds }] });
  if (tone !== "error") setTimeout(() => dismiss(id), action ? 3 * SHOWN_MS : SHOWN_MS);
}

useStudio.subscribe((now) => {
  for (const { id, holds } of useDialogs.getState().notices) if (holds && !holds(now)) dismiss(id);
});

export function dismiss(id: number): void {
  useDialogs.setState(({ notices }) => ({ notices: notices.filter((notice) => notice.id !== id) }));
}
