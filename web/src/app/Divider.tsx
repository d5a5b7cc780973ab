import { useRef, type KeyboardEvent, type PointerEvent } from "react";

interface DividerProps {
  label: string;
  /** The share, 0 to 1, of what stands before the divider (behind it where `reversed`). */
  share: number;
  onShare: (share: number) => void;
  orientation: "vertical" | "horizontal";
  reversed?: boolean;
}

const LEAST = 0.15;
const STEP = 0.02;
const clamp = (share: number) => Math.min(1 - LEAST, Math.max(LEAST, share));

/** A bar between two areas: dragged, or moved by arrow keys. */
export function Divider({ label, share, onShare, orientation, reversed = false }: DividerProps) {
  const bar = useRef<HTMLDivElement>(null);

  const drag = (event: PointerEvent) => {
    if (!bar.current?.hasPointerCapture(event.pointerId)) return;
    const box = bar.current.parentElement!.getBoundingClientRect();
    const before =
      orientation === "vertical" ? (event.clientX - box.left) / box.width : (event.clientY - box.top) / box.height;
    onShare(clamp(reversed ? 1 - before : before));
  };
  const press = (event: KeyboardEvent) => {
    const keys = orientation === "vertical" ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const way = keys.indexOf(event.key) * 2 - 1;
    if (!keys.includes(event.key)) return;
    event.preventDefault();
    onShare(clamp(share + (reversed ? -way : way) * STEP));
  };

  return (
    <div
      ref={bar}
      className={`divider ${orientation}`}
      role="separator"
      tabIndex={0}
      aria-label={label}
      aria-orientation={orientation}
      aria-valuenow={Math.round(share * 100)}
      aria-valuemin={LEAST * 100}
      aria-valuemax={(1 - LEAST) * 100}
      onPointerDown={(event) => bar.current?.setPointerCapture(event.pointerId)}
      onPointerMove={drag}
      onKeyDown={press}
    />
  );
}
