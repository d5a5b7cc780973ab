/** Only the rows in sight are made: 511 words of 15 fields would cost each edit a tenth of a second. */

import { useEffect, useState, type RefObject } from "react";
import { flushSync } from "react-dom";

export const ROW_PX = 30;
const SPARE = 6;

export function useRows(scroller: RefObject<HTMLElement | null>, count: number) {
  const [seen, setSeen] = useState({ top: 0, height: 600, all: false });

  useEffect(() => {
    const element = scroller.current!;
    const look = () => setSeen((before) => ({ ...before, top: element.scrollTop, height: element.clientHeight }));
    const print = (all: boolean) => () => flushSync(() => setSeen((before) => ({ ...before, all })));
    const [before, after] = [print(true), print(false)];
    const resized = new ResizeObserver(look);
    resized.observe(element);
    element.addEventListener("scroll", look, { passive: true });
    window.addEventListener("beforeprint", before);
    window.addEventListener("afterprint", after);
    return () => {
      resized.disconnect();
      element.removeEventListener("scroll", look);
      window.removeEventListener("beforeprint", before);
      window.removeEventListener("afterprint", after);
    };
  }, [scroller]);

  const first = seen.all ? 0 : Math.max(0, Math.min(count - 1, Math.floor(seen.top / ROW_PX) - SPARE));
  const last = seen.all ? count : Math.min(count, Math.ceil((seen.top + seen.height) / ROW_PX) + SPARE);
  const bringIntoView = (row: number) => {
    const { scrollTop = 0, clientHeight = 0 } = scroller.current ?? {};
    const top = row * ROW_PX;
    // The table's head lies above its first row.
    const bottom = top + 2 * ROW_PX;
    if (top < scrollTop) scroller.current?.scrollTo({ top });
    else if (bottom > scrollTop + clientHeight) scroller.current?.scrollTo({ top: bottom - clientHeight });
  };
  return { first, last, height: count * ROW_PX, offset: first * ROW_PX, bringIntoView };
}
