import { useEffect, useRef } from "react";
import { isCalm } from "../ui/areas";
import dialogs from "./dialogs.module.css";

/** Where the hand goes at each step of the tour, from part to part of the page. */
const WAYS = {
  drag: ["#followers-blocks .blocklyToolboxCategory", "#followers-blocks .blocklyDraggable"],
  choose: ["#followers-blocks .blocklyDraggable .blocklyDraggable", "#followers-blocks .blocklyDraggable .blocklyDropdownField"],
  play: ["#stage", "#mat-play"],
} as const;
const SHOWN_MS = 2600;
/** Below the hat is where a block is dropped. */
const BELOW_PX = 16;

/** A hand that shows once what is to be done; nothing where nothing may move. */
export function GhostHand({ step }: { step: keyof typeof WAYS }) {
  const hand = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const parts = WAYS[step].map((part) => document.querySelector(part)?.getBoundingClientRect());
    if (isCalm() || parts.some((part) => !part?.width)) return;
    const moves = parts.map((part, at) => {
      const isDrop = step === "drag" && at > 0;
      return { transform: `translate(${part!.x + part!.width / 2}px, ${isDrop ? part!.bottom + BELOW_PX : part!.y + part!.height / 2}px)`, opacity: 1 };
    });
    const shown = hand.current!.animate([{ ...moves[0], opacity: 0 }, ...moves, { ...moves.at(-1), opacity: 0 }], {
      duration: SHOWN_MS,
      easing: "ease-in-out",
    });
    return () => shown.cancel();
  }, [step]);
  return (
    <div ref={hand} className={dialogs.hand} aria-hidden="true">
      <svg viewBox="0 0 24 24">
        <path d="M9 3a1.5 1.5 0 0 1 3 0v7l5.6 1.2a2 2 0 0 1 1.6 2.2l-.7 5A3 3 0 0 1 15.5 21H11a3 3 0 0 1-2.3-1.1L4.5 14.5a1.5 1.5 0 0 1 2.2-2L9 14.5z" />
      </svg>
    </div>
  );
}
