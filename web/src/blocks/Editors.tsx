import * as Blockly from "blockly/core";
import { useEffect, useRef, useState, type CSSProperties, type ReactNode } from "react";
import { Input, SearchField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { EditorName } from "../api/types";
import { confirm, notify } from "../state/dialogs";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { Divider } from "../ui/areas";
import { Check, IconButton } from "../ui/controls";
import { collectEdits, noteEdit } from "../words/compiling";
import { forgetMarks, markDiagnostics, markRunning } from "./marks";
import { createWorkspace, disposeWorkspace, emptyState, fill, findBlocks, read, revealBlock, showBlock, workspaceOf } from "./workspaces";
import css from "./blocks.module.css";
import areas from "../ui/areas.module.css";
import { classes } from "../ui/classes";

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
    noteEdit(editor);
  }
}

/** One of Blockly's workspaces, as large as its place on the page. */
function Editor({ editor }: { editor: EditorName }) {
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

  return <div className={css.host} ref={host} id={`${editor}-blocks`} />;
}

/** Find blocks by their text and step through them. */
function SearchBar({ editor, onClose }: { editor: EditorName; onClose: () => void }) {
  const { t } = useTranslation();
  const [query, setQuery] = useState("");
  const [at, setAt] = useState(-1);
  const workspace = workspaceOf(editor);
  const found = workspace ? findBlocks(workspace, query) : [];

  const step = (way: number) => {
    if (found.length === 0) return;
    const next = (at + way + found.length) % found.length;
    setAt(next);
    revealBlock(found[next]!);
  };
  const leave = () => {
    const match = found[at];
    onClose();
    if (match) showBlock(editor, match.id);
  };

  return (
    <div className={css.searchBar} role="search">
      <SearchField
        aria-label={t("search.label")}
        value={query}
        onChange={(text) => {
          setQuery(text);
          setAt(-1);
        }}
        autoFocus
      >
        <Input
          placeholder={t("search.placeholder")}
          onKeyDown={(event) => {
            if (event.key === "Enter") step(event.shiftKey ? -1 : 1);
            if (event.key === "Escape") leave();
          }}
        />
      </SearchField>
      <span className={css.searchCount} role="status">
        {query && (found.length ? t("search.count", { at: at + 1, of: found.length }) : t("search.none"))}
      </span>
      <IconButton icon="up" label={t("search.previous")} onPress={() => step(-1)} isDisabled={found.length === 0} />
      <IconButton icon="down" label={t("search.next")} onPress={() => step(1)} isDisabled={found.length === 0} />
      <IconButton icon="close" label={t("search.close")} onPress={leave} />
    </div>
  );
}

/** An editor under its name and tools. */
function EditorPane({ editor, children }: { editor: EditorName; children?: ReactNode }) {
  const { t } = useTranslation();
  const [searching, setSearching] = useState(false);
  return (
    <section className={classes(css.pane, areas.panel)} data-view={editor} aria-labelledby={`${editor}-title`}>
      <header className={areas.paneHead}>
        <h2 id={`${editor}-title`} className={css.title} data-editor={editor}>
          {t(`editors.${editor}`)}
        </h2>
        {children}
        <div className={areas.paneTools}>
          <IconButton icon="undo" label={t("editors.undo")} onPress={() => workspaceOf(editor)?.undo(false)} />
          <IconButton icon="redo" label={t("editors.redo")} onPress={() => workspaceOf(editor)?.undo(true)} />
          <IconButton icon="tidy" label={t("editors.tidy")} onPress={() => workspaceOf(editor)?.cleanUp()} />
          <IconButton icon="search" label={t("search.open")} onPress={() => setSearching(true)} />
        </div>
      </header>
      {searching && <SearchBar editor={editor} onClose={() => setSearching(false)} />}
      <Editor editor={editor} />
    </section>
  );
}

function addFollowers(): void {
  const { followers, parkedFollowers } = useStudio.getState();
  if (followers === null) {
    useStudio.setState({ followers: parkedFollowers ?? emptyState("followers"), parkedFollowers: null });
  }
}

/** The leader's editor and, if it is switched on, the followers' beside it. */
export function Editors() {
  const { t } = useTranslation();
  const followed = useStudio((studio) => studio.followers !== null);
  const share = useSettings((settings) => settings.shares.editors);

  const dropFollowers = async () => {
    collectEdits();
    const hasSteps = (workspaceOf("followers")?.getAllBlocks(false).length ?? 0) > 1;
    const agreed =
      !hasSteps ||
      (await confirm({ title: t("editors.dropTitle"), text: t("editors.dropText"), yes: t("editors.dropYes") }));
    if (!agreed) return;
    useStudio.setState(({ followers }) => ({ parkedFollowers: followers, followers: null }));
    if (hasSteps) notify(t("editors.dropped"), "info", { label: t("editors.bringBack"), run: addFollowers });
  };

  return (
    <div className={css.editors} style={{ "--share": followed ? share : 1 } as CSSProperties} data-followed={followed}>
      <EditorPane editor="leader">
        <Check
          id="program-followers"
          small
          checked={followed}
          onChange={(wanted) => (wanted ? addFollowers() : void dropFollowers())}
        >
          {t("editors.programFollowers")}
        </Check>
      </EditorPane>
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
  );
}
