/** Short words to the user: shown for a while, and read out. */

import { create } from "zustand";

export type Tone = "info" | "success" | "warning" | "error";

export interface Notice {
  id: number;
  text: string;
  tone: Tone;
  action?: { label: string; run: () => void };
}

export const useNotices = create<{ notices: Notice[] }>(() => ({ notices: [] }));
const SHOWN_MS = 8000;
let last = 0;

export function tell(text: string, tone: Tone = "info", action?: Notice["action"]): void {
  const id = ++last;
  const others = useNotices.getState().notices.filter((notice) => notice.text !== text);
  useNotices.setState({ notices: [...others.slice(-2), { id, text, tone, action }] });
  // What went wrong stays until it was read, what offers something for longer.
  if (tone !== "error") setTimeout(() => dismiss(id), action ? 3 * SHOWN_MS : SHOWN_MS);
}

export function dismiss(id: number): void {
  useNotices.setState(({ notices }) => ({ notices: notices.filter((notice) => notice.id !== id) }));
}
