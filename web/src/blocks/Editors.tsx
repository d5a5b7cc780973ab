import * as Blockly from "blockly/core";
import { useEffect, useRef, type CSSProperties } from "react";
import { ToggleButton, ToggleButtonGroup } from "react-aria-components";
import { type EditorName, EDITORS } from "../api/types";
import { say, useTexts } from "../i18n";
import { notify } from "../state/dialogs";
import { isForeign, usePair } from "../pair/store";
import { endEdit, endMovesBy, record, useHistory } from "../state/history";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { endAll, listen, watchSize } from "../ui/areas";
import { Divider } from "../ui/panes";
import { IconButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import { noteEdit } from "../words/compiling";
import { Mistake } from "./Mistake";
import { watchDecisions } from "./decided";
import { drawInView } from "./inView";
import { forgetMarks, markDiagnostics, markBlocks, markLoose } from "./marks";
import { parkFollowers, recordFollowers, unparkFollowers } from "./rows";
import { createWorkspace, disposeWorkspace, fill, liveWorkspaces, read, workspaceOf } from "./workspaces";
import css from "./blocks.module.css";
import areas from "../ui/areas.module.css";
import { classes } from "../ui/classes";

function refill(editor: EditorName): void {
  forgetMarks(editor);
  fill(editor, useStudio.getState()[editor] ?? {});
  useStudio.setState({ [editor]: read(editor), selection: null });
  markLoose(editor);
}

function onEvent(editor: EditorName, event: Blockly.Events.Abstract): void {
  if (event instanceof Blockly.Events.Selected) {
    const block = event.newElementId;
    const selection = useStudio.getState().selection;
    if (block) useStudio.setState({ selection: { editor, block } });
    else if (selection?.editor === editor) useStudio.setState({ selection: null });
  } else if (event instanceof Blockly.Events.BlockDrag && !event.isStart) {
    markLoose(editor);
  } else if (!event.isUiEvent) {
    markLoose(editor);
    noteEdit(editor);
    if (event.recordUndo) noteUndo(editor, event.group);
  }
}

/** Blockly undoes a group of events, or one without a group, at a time. */
function noteUndo(editor: EditorName, group: string): void {
  const key = `${editor} ${group}`;
  if (group && useHistory.getState().done.at(-1)?.key === key) return;
  endEdit();
  record({ key, undo: () => workspaceOf(editor)?.undo(false), redo: () => workspaceOf(editor)?.undo(true) });
}

/** End the move of a block by the mouse or the arrow keys: Blockly can't undo a block that is being moved, and keeps it for ever. */
function endMove(): boolean {
  const { mover } = Blockly.KeyboardMover;
  if (mover.isMoving()) return mover.abortMove();
  const moving = liveWorkspaces().find(([, workspace]) => workspace.isDragging());
  moving?.[1].cancelCurrentGesture();
  return moving !== undefined;
}
endMovesBy(endMove);

/** Above blocks that this page only shows: who makes them. */
function Owner({ editor }: { editor: EditorName }) {
  const t = useTexts();
  const foreign = usePair((pair) => isForeign(pair, editor));
  const name = usePair(({ view }) => (view?.owners[editor] ? view.partner?.name : null));
  return foreign && <p className={css.owner}>{name ? t("pair.readOnly", { name }) : t("pair.readOnlyFree")}</p>;
}

/** One of Blockly's workspaces, as large as its place on the page. */
function Editor({ editor }: { editor: EditorName }) {
  const host = useRef<HTMLDivElement>(null);
  const generation = useStudio((studio) => studio.generation);

  useEffect(() => {
    const workspace = createWorkspace(host.current!, editor);
    const listener = (event: Blockly.Events.Abstract) => onEvent(editor, event);
    workspace.addChangeListener(listener);
    // Blockly tells of what is typed only after the next picture. Its fields lie outside the editor.
    const onInput = ({ target }: Event) => {
      const typed = target instanceof Element && target.classList.contains("blocklyHtmlInput");
      if (typed && Blockly.getMainWorkspace() === workspace) noteEdit(editor);
    };
    return endAll(
      listen(document, ["input"], onInput),
      drawInView(editor, workspace),
      watchSize(host.current!, () => Blockly.svgResize(workspace)),
      useStudio.subscribe((now, before) => now.running !== before.running && markBlocks("motorcade-running", now.running)),
      watchDecisions(),
      () => disposeWorkspace(editor),
      () => markLoose(editor),
    );
  }, [editor]);

  useEffect(() => {
    refill(editor);
    markDiagnostics(useStudio.getState().compiled?.diagnostics ?? []);
  }, [editor, generation]);

  return (
    <div className={classes("unprinted fill anchor", css.host)} ref={host} id={`${editor}-blocks`}>
      <Owner editor={editor} />
      <Mistake editor={editor} host={host} />
    </div>
  );
}

function addFollowers(): void {
  unparkFollowers();
  recordFollowers(true);
}

function dropFollowers(): void {
  const hasSteps = (workspaceOf("followers")?.getAllBlocks(false).length ?? 0) > 1;
  parkFollowers();
  recordFollowers(false);
  const action = { label: say("editors.bringBack"), run: addFollowers };
  if (hasSteps) notify(say("editors.dropped"), "info", action, ({ parkedFollowers }) => parkedFollowers !== null);
}

/** The names of both editors, of which the chosen one shows where there is room for one, and the tools for it. */
function EditorBar({ followed }: { followed: boolean }) {
  const t = useTexts();
  const editor = useStudio((studio) => studio.editor);
  const larger = useStudio((studio) => studio.larger);
  return (
    <div className={css.bar}>
      <ToggleButtonGroup
        className="row tight"
        aria-label={t("editors.which")}
        disallowEmptySelection
        selectedKeys={[editor]}
        onSelectionChange={(keys) => {
          const wanted = [...keys][0] as EditorName;
          if (wanted === "followers" && !followed) addFollowers();
          else useStudio.setState({ editor: wanted });
        }}
      >
        {EDITORS.map((each) => (
          <ToggleButton key={each} id={each} className={css.name} data-editor={each}>
            {each === "followers" && !followed ? <Icon name="plus" /> : <span className="dot" />}
            {t(`editors.${each}`)}
          </ToggleButton>
        ))}
      </ToggleButtonGroup>
      <div className={areas.paneTools}>
        {followed && editor === "followers" && <IconButton icon="trash" label={t("editors.leaderOnly")} onPress={dropFollowers} />}
        <IconButton icon="tidy" label={t("editors.tidy")} onPress={() => workspaceOf(editor)?.cleanUp()} />
        <span className={css.swap}>
          <IconButton
            icon={larger === "stage" ? "up" : "down"}
            label={t(larger === "stage" ? "editors.largerBlocks" : "editors.largerStage")}
            onPress={() => useStudio.setState({ larger: larger === "stage" ? "blocks" : "stage" })}
          />
        </span>
      </div>
    </div>
  );
}

function EditorPane({ editor }: { editor: EditorName }) {
  const t = useTexts();
  const shown = useStudio((studio) => studio.editor);
  return (
    <section
      className={css.pane}
      data-shown={shown === editor || undefined}
      data-keys="own"
      aria-label={t(`editors.${editor}`)}
      onFocusCapture={() => shown !== editor && useStudio.setState({ editor })}
    >
      <Editor editor={editor} />
    </section>
  );
}

/** The leader's editor and, if it is switched on, the followers': side by side where there is room. */
export function Editors() {
  const t = useTexts();
  const followed = useStudio((studio) => studio.followers !== null);
  const share = useSettings((settings) => settings.shares.editors);
  return (
    <div className={classes("printed-whole", css.editors, areas.panel)}>
      <EditorBar followed={followed} />
      <div className={css.panes} style={{ "--share": followed ? share : 1 } as CSSProperties} data-followed={followed}>
        <EditorPane editor="leader" />
        {followed && (
          <>
            <Divider
              label={t("editors.divider")}
              share={share}
              orientation="vertical"
              onShare={(editors) => useSettings.setState(({ shares }) => ({ shares: { ...shares, editors } }))}
            />
            <EditorPane editor="followers" />
          </>
        )}
      </div>
    </div>
  );
}
