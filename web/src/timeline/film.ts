/** A film of a run that the browser makes from the stage, by MediaRecorder. */

import { session } from "../mat/session";
import { useMat } from "../mat/store";

/** The first that a browser can make is made; Safari makes MP4 alone. */
const KINDS = [
  { type: "video/mp4;codecs=avc1.42E01F", ending: ".mp4" },
  { type: "video/webm;codecs=vp9", ending: ".webm" },
  { type: "video/webm", ending: ".webm" },
] as const;
const PICTURES_A_SECOND = 25;
const LONGEST_WAIT_MS = 1000;

/** The kind of film that this browser can make; null for none. */
export function filmKind(): (typeof KINDS)[number] | null {
  if (typeof MediaRecorder === "undefined" || !("captureStream" in HTMLCanvasElement.prototype)) return null;
  return KINDS.find(({ type }) => MediaRecorder.isTypeSupported(type)) ?? null;
}

/**
 * Show the last seconds of the run again, and record the stage meanwhile. It takes as long as the film lasts, longer
 * where moments come late. The world doesn't play meanwhile, and shows the present afterwards.
 */
export async function film(stage: HTMLCanvasElement, type: string, seconds: number): Promise<Blob> {
  const { state } = useMat.getState();
  const endMs = state?.t_ms ?? 0;
  const beginMs = Math.max(state?.earliest_ms ?? 0, endMs - seconds * 1000);
  const stepMs = 1000 / PICTURES_A_SECOND;
  session.send({ do: "pause" });
  await showMoment(beginMs);
  const recorder = new MediaRecorder(stage.captureStream(PICTURES_A_SECOND), { mimeType: type });
  const parts: Blob[] = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  const stopped = new Promise((resolve) => recorder.addEventListener("stop", resolve, { once: true }));
  recorder.start();
  const startedAt = performance.now();
  for (let tMs = beginMs; tMs <= endMs; tMs += stepMs) {
    await showMoment(Math.round(tMs));
    const early = startedAt + (tMs - beginMs) - performance.now();
    if (early > 0) await new Promise((resolve) => setTimeout(resolve, early));
  }
  recorder.stop();
  await stopped;
  session.seek(null);
  if (state?.playing) session.play();
  return new Blob(parts, { type });
}

/** Show a stored moment; wait until its picture has come. */
function showMoment(tMs: number): Promise<void> {
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(patience);
      forget();
      resolve();
    };
    const forget = session.listen(({ past }) => past && end());
    const patience = setTimeout(end, LONGEST_WAIT_MS);
    session.send({ do: "seek", t_ms: tMs });
  });
}
