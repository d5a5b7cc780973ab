import { type CSSProperties, type RefObject, useEffect, useState } from "react";
import type { Diagnostic, EditorName } from "../api/types";
import { inLanguage, useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { FixButtons } from "./fixes";
import { workspaceOf } from "./workspaces";
import { TextButton } from "../ui/controls";
import css from "./mistakes.module.css";

/** The narrowest place beside a block for a sentence, as wide as the style sheet lets it be; else it stands below. */
const ROOM_PX = 275;
const GAP_PX = 10;

interface Place {
  left: number;
  top: number;
}

/** Beside the block, or below it, in the pixels of its host; null while it is out of sight. */
function placeOf(editor: EditorName, id: string, host: HTMLElement): Place | null {
  const path = workspaceOf(editor)?.getBlockById(id)?.pathObject as { svgPath?: SVGElement } | undefined;
  const block = path?.svgPath?.getBoundingClientRect();
  const room = host.getBoundingClientRect();
  if (!block || block.width === 0 || block.bottom < room.top + GAP_PX || block.top > room.bottom - GAP_PX) return null;
  const beside = room.right - block.right > ROOM_PX;
  const left = beside ? block.right + GAP_PX : Math.max(room.left, Math.min(block.left, room.right - ROOM_PX));
  return { left: left - room.left, top: Math.max(0, (beside ? block.top : block.bottom) - room.top) };
}

/** The wrong block to speak of: the selected one, or else the first. */
function useWrong(editor: EditorName): Diagnostic | null {
  const diagnostics = useStudio(({ compiled }) => compiled?.diagnostics);
  const selected = useStudio(({ selection }) => (selection?.editor === editor ? selection.block : null));
  const wrong = (diagnostics ?? []).filter((each) => each.severity === "error" && each.editor === editor && each.block !== null);
  return wrong.find(({ block }) => block === selected) ?? wrong[0] ?? null;
}

/** The sentence of a wrong block beside it, and the buttons that fix it. The list of problems has it for screen readers. */
export function Mistake({ editor, host }: { editor: EditorName; host: RefObject<HTMLDivElement | null> }) {
  const t = useTexts();
  const wrong = useWrong(editor);
  const [place, setPlace] = useState<Place | null>(null);
  const [hidden, setHidden] = useState<string | null>(null);
  const block = wrong?.block;

  useEffect(() => {
    const workspace = workspaceOf(editor);
    if (!block || !workspace) return;
    let frame = 0;
    const look = () => {
      frame = 0;
      if (host.current) setPlace(placeOf(editor, block, host.current));
    };
    const soon = () => (frame ||= requestAnimationFrame(look));
    soon();
    workspace.addChangeListener(soon);
    return () => {
      workspace.removeChangeListener(soon);
      cancelAnimationFrame(frame);
    };
  }, [editor, block, host]);

  const sentence = wrong ? inLanguage(wrong.sentence) : "";
  if (!wrong || !place || hidden === sentence) return null;
  return (
    <div className={css.column} style={{ left: place.left, "--top": `${place.top}px` } as CSSProperties}>
      <div className={css.mistake} role="note" aria-label={t("words.diagnostics")}>
        <p>{sentence}</p>
        <div className="wrap">
          <FixButtons diagnostic={wrong} />
          <TextButton quiet onPress={() => setHidden(sentence)}>{t("app.dismiss")}</TextButton>
        </div>
      </div>
    </div>
  );
}
