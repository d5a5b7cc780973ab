import * as Blockly from "blockly/core";
import { useEffect, useRef } from "react";
import type { EditorName } from "../api/types";
import { useStudio } from "../app/store";
import { touched } from "../words/compiling";
import { forgetMarks, markDiagnostics, markRunning } from "./marks";
import { createWorkspace, disposeWorkspace, fill, read } from "./workspaces";

function refill(editor: EditorName): void {
  forgetMarks(editor);
  fill(editor, useStudio.getState()[editor] ?? {});
  useStudio.setState({ [editor]: read(editor), selection: null });
}

function onEvent(editor: EditorName, event: Blockly.Events.Abstract): void {
  if (event instanceof Blockly.Events.Selected) {
    const block = event.newElementId;
    const selection = useStudio.getState().selection;
    if (block) useStudio.setState({ selection: { editor, block } });
    else if (selection?.editor === editor) useStudio.setState({ selection: null });
  } else if (!event.isUiEvent) {
    touched(editor);
  }
}

/** One of Blockly's workspaces, kept as large as its place on the page. */
export function Editor({ editor }: { editor: EditorName }) {
  const host = useRef<HTMLDivElement>(null);
  const generation = useStudio((studio) => studio.generation);

  useEffect(() => {
    const workspace = createWorkspace(host.current!, editor);
    const listener = (event: Blockly.Events.Abstract) => onEvent(editor, event);
    workspace.addChangeListener(listener);
    const resized = new ResizeObserver(() => Blockly.svgResize(workspace));
    resized.observe(host.current!);
    const unsubscribe = useStudio.subscribe((now, before) => {
      if (now.running !== before.running) markRunning(now.running);
    });
    return () => {
      unsubscribe();
      resized.disconnect();
      disposeWorkspace(editor);
    };
  }, [editor]);

  useEffect(() => {
    refill(editor);
    markDiagnostics(useStudio.getState().compiled?.diagnostics ?? []);
  }, [editor, generation]);

  return <div className="editor-host" ref={host} id={`${editor}-blocks`} />;
}
