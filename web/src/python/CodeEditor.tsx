/** An editor of Python text by CodeMirror, which is loaded when it is shown for the first time. */

import { autocompletion } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { python } from "@codemirror/lang-python";
import { bracketMatching, HighlightStyle, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { type Action, type Diagnostic as Mark, lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { Annotation, EditorState, type Extension, RangeSetBuilder, StateEffect, StateField, type Text } from "@codemirror/state";
import { Decoration, type DecorationSet, drawSelection, EditorView, highlightActiveLine, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { useEffect, useRef } from "react";
import type { Diagnostic } from "../api/types";
import { applyFix } from "../blocks/fixes";
import { inLanguage, useLanguage, useTexts } from "../i18n";
import type { TextPlace } from "../generated/messages";
import { useStudio } from "../state/studio";
import { endAll, watchSize } from "../ui/areas";
import { completeAt } from "./completion";
import { editText, usePython } from "./text";
import css from "./python.module.css";

/** On changes that come from the blocks. */
const fromBlocks = Annotation.define<boolean>();
const setLit = StateEffect.define<readonly TextPlace[]>();

const offsetIn = (text: Text, line: number, column: number) => {
  const row = text.line(Math.min(line, text.lines));
  return Math.min(row.from + column - 1, row.to);
};

/** The lines of the selected block. */
const litLines = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(lines, transaction) {
    for (const effect of transaction.effects) {
      if (!effect.is(setLit)) continue;
      const builder = new RangeSetBuilder<Decoration>();
      const { doc } = transaction.state;
      for (const { line, end_line } of effect.value) {
        for (let at = line; at <= Math.min(end_line, doc.lines); at++) builder.add(doc.line(at).from, doc.line(at).from, Decoration.line({ class: css.lit! }));
      }
      return builder.finish();
    }
    return lines.map(transaction.changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});

const colours = HighlightStyle.define([
  { tag: tags.comment, class: css.comment },
  { tag: [tags.number, tags.bool], class: css.number },
  { tag: tags.string, class: css.string },
  { tag: [tags.keyword, tags.moduleKeyword], class: css.keyword },
  { tag: tags.function(tags.variableName), class: css.call },
]);

const EXTENSIONS: Extension = [
  lineNumbers(),
  history(),
  drawSelection(),
  bracketMatching(),
  highlightActiveLine(),
  indentUnit.of("    "),
  python(),
  syntaxHighlighting(colours),
  lintGutter(),
  autocompletion({
    icons: false,
    interactionDelay: 0,
    override: [
      (context) => {
        const { profileFigures } = useStudio.getState();
        return profileFigures && completeAt(context, profileFigures);
      },
    ],
  }),
  litLines,
  // The Tab key leaves the editor, as everywhere on the page.
  keymap.of([...defaultKeymap, ...historyKeymap, ...lintKeymap]),
  EditorView.lineWrapping,
  EditorView.updateListener.of((update) => {
    const typed = update.docChanged && !update.transactions.some((each) => each.annotation(fromBlocks));
    if (typed) editText(update.state.doc.toString());
  }),
];

/** The least change from one text to another, so that the cursor stays where it is. */
function change(before: string, now: string): { from: number; to: number; insert: string } {
  let from = 0;
  while (from < Math.min(before.length, now.length) && before[from] === now[from]) from++;
  let end = 0;
  while (end < Math.min(before.length, now.length) - from && before.at(-1 - end) === now.at(-1 - end)) end++;
  return { from, to: before.length - end, insert: now.slice(from, now.length - end) };
}

/** A diagnostic as CodeMirror shows it, with its fixes as actions; null for one that has no place in the text. */
function markOf(diagnostic: Diagnostic, place: TextPlace | undefined, text: Text): Mark | null {
  const where = diagnostic.place ?? place;
  if (!where) return null;
  const from = offsetIn(text, where.line, where.column);
  const to = offsetIn(text, where.end_line, where.end_column);
  const actions = (diagnostic.fixes ?? []).map((each): Action => ({
    name: inLanguage(each.sentence),
    apply: () => applyFix(diagnostic, each),
  }));
  return { from, to, severity: diagnostic.severity === "error" ? "error" : "warning", message: inLanguage(diagnostic.sentence), actions };
}

function showMarks(view: EditorView): void {
  const { diagnostics, places } = usePython.getState();
  const byBlock = new Map(places.map((each) => [each.block, each]));
  const all = [...diagnostics, ...(useStudio.getState().compiled?.diagnostics ?? [])];
  const marks = all.map((each) => markOf(each, byBlock.get(each.block ?? ""), view.state.doc)).filter((each) => each !== null);
  view.dispatch(setDiagnostics(view.state, marks));
}

function showText(view: EditorView): void {
  const { text } = usePython.getState();
  const before = view.state.doc.toString();
  if (before !== text) view.dispatch({ changes: change(before, text), annotations: fromBlocks.of(true) });
}

function showSelection(view: EditorView): void {
  const block = useStudio.getState().selection?.block;
  const lit = usePython.getState().places.filter((each) => each.block === block);
  view.dispatch({ effects: setLit.of(lit) });
}

export default function CodeEditor() {
  const t = useTexts();
  const language = useLanguage();
  const host = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const label = EditorView.contentAttributes.of({ "aria-label": t("python.text"), "aria-describedby": "python-about", spellcheck: "false" });
    const phrases = EditorState.phrases.of({ Completions: t("python.completions") });
    const state = EditorState.create({ doc: usePython.getState().text, extensions: [EXTENSIONS, label, phrases] });
    const view = new EditorView({ state, parent: host.current! });
    const show = () => {
      showText(view);
      showMarks(view);
      showSelection(view);
    };
    show();
    // A mistake that is told below takes room: the cursor, and the list at it, stay in view.
    return endAll(
      watchSize(host.current!, () => view.hasFocus && view.dispatch({ effects: EditorView.scrollIntoView(view.state.selection.main.head) })),
      usePython.subscribe(show),
      useStudio.subscribe((now, before) => {
        if (now.compiled !== before.compiled) showMarks(view);
        if (now.selection !== before.selection) showSelection(view);
      }),
      () => view.destroy(),
    );
  }, [t, language]);
  return <div className={css.editor} ref={host} />;
}
