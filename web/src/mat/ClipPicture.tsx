import { useEffect, useRef, useState } from "react";
import type { Clip } from "./clips";
import { Picture } from "./Picture";

const CALM = "(prefers-reduced-motion: reduce)";
/** What moves by itself must stop by itself within this time (WCAG 2.2.2). */
const BY_ITSELF_MS = 5_000;
const DRAWN_EVERY_MS = 40;

interface ClipPictureProps {
  clip: Clip;
  /** It moves as long as this is so; else for five seconds when it comes into view, and never where users want calm. */
  moves?: boolean;
  /** In pixels; without it, it fills its place. */
  size?: { width: number; height: number };
}

/** A run from above, that moves. */
export function ClipPicture({ clip, moves: isMoved = false, size }: ClipPictureProps) {
  const [tMs, setTime] = useState(0);
  const [isInView, setInView] = useState(false);
  const [isPointedAt, setPointedAt] = useState(false);
  const moves = isMoved || isPointedAt;
  const frame = useRef<SVGSVGElement>(null);
  const shown = useRef(0);
  useEffect(() => {
    const observer = new IntersectionObserver(([entry]) => setInView(entry!.isIntersecting), { threshold: 0.6 });
    observer.observe(frame.current!);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (!(moves || isInView) || matchMedia(CALM).matches) return;
    const began = performance.now() - shown.current;
    const until = moves ? Infinity : performance.now() + BY_ITSELF_MS;
    let request = 0;
    const draw = (now: number) => {
      if (now > until) return;
      const at = Math.max(0, now - began) % clip.durationMs;
      if (Math.abs(at - shown.current) >= DRAWN_EVERY_MS) {
        shown.current = at;
        setTime(at);
      }
      request = requestAnimationFrame(draw);
    };
    request = requestAnimationFrame(draw);
    return () => cancelAnimationFrame(request);
  }, [clip, moves, isInView]);
  return <Picture ref={frame} mat={clip.mat} cars={clip.at(tMs)} tMs={tMs} way={clip.way} size={size} onPoint={setPointedAt} />;
}
