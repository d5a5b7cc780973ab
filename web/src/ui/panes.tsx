/** What the page's areas share: a divider between two, a boundary around one that may fail, how far one is scrolled, and printing. */

import { Component, Suspense, useEffect, useRef, useState, type KeyboardEvent, type PointerEvent, type ReactNode, type RefObject } from "react";
import { flushSync } from "react-dom";
import { useTexts } from "../i18n";
import { endAll, listen, watchSize } from "./areas";
import { classes } from "./classes";
import areas from "./areas.module.css";
import buttons from "./buttons.module.css";

interface DividerProps {
  label: string;
  /** The share, 0 to 1, of the area before the divider; of the one after it where `reversed`. */
  share: number;
  onShare: (share: number) => void;
  orientation: "vertical" | "horizontal";
  reversed?: boolean;
}

const LEAST = 0.15;
const STEP = 0.02;
const clamp = (share: number) => Math.min(1 - LEAST, Math.max(LEAST, share));

/** A bar between two areas, moved by dragging or by arrow keys. */
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
      className={areas.divider}
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

interface ErrorBoundaryProps {
  /** Shown in place of the children once they failed. */
  fallback?: ReactNode;
  onFailure?: () => void;
  children: ReactNode;
}

/** Contain an error of its children, such as a part of the page that can't be fetched, so that the rest stays. */
export class ErrorBoundary extends Component<ErrorBoundaryProps, { failed: boolean }> {
  override state = { failed: false };

  static getDerivedStateFromError(): { failed: boolean } {
    return { failed: true };
  }

  override componentDidCatch(): void {
    this.props.onFailure?.();
  }

  override render(): ReactNode {
    return this.state.failed ? this.props.fallback : this.props.children;
  }
}

/** Load the page again: a browser doesn't fetch a failed part of a page a second time. Autosave keeps the work. */
export function reload(): void {
  location.reload();
}

interface LaterProps {
  /** Shown until the children are fetched. */
  waiting?: ReactNode;
  children: ReactNode;
}

/** What is fetched when it is first shown: where that fails, a sentence stands in its place, and the rest of the page stays. */
export function Later({ waiting, children }: LaterProps) {
  const t = useTexts("app");
  const failed = (
    <div className={areas.failed} role="alert">
      <p>{t("failed")}</p>
      <button type="button" className={classes(buttons.button, buttons.primary)} onClick={reload}>
        {t("reload")}
      </button>
    </div>
  );
  return (
    <ErrorBoundary fallback={failed}>
      <Suspense fallback={waiting}>{children}</Suspense>
    </ErrorBoundary>
  );
}

/** How far an element is scrolled down, and how high its view is. */
export function useScroll(scroller: RefObject<HTMLElement | null>): { top: number; height: number } {
  const [seen, setSeen] = useState({ top: 0, height: 600 });
  useEffect(() => {
    const element = scroller.current!;
    const look = () => setSeen({ top: element.scrollTop, height: element.clientHeight });
    return endAll(watchSize(element, look), listen(element, ["scroll"], look));
  }, [scroller]);
  return seen;
}

/**
 * Print the page. A browser pauses a page that asks for it, from before `beforeprint` until after `afterprint`, and React Aria
 * throws there: so what is printed is shown before.
 */
export function print(): void {
  window.dispatchEvent(new Event("printing"));
  window.print();
}

/** Whether the page is being printed: all words are then shown in any case. */
export function usePrinting(): boolean {
  const [printing, setPrinting] = useState(false);
  useEffect(() => {
    const show = ({ type }: Event) => (type === "afterprint" ? setPrinting(false) : flushSync(() => setPrinting(true)));
    return listen(window, ["printing", "beforeprint", "afterprint"], show);
  }, []);
  return printing;
}

/** While the component is shown, the style sheets know what the page shows, or what of it is printed. */
export function usePageState(name: "print" | "tour", value: string): void {
  useEffect(() => {
    document.documentElement.dataset[name] = value;
    return () => {
      Reflect.deleteProperty(document.documentElement.dataset, name);
    };
  }, [name, value]);
}
