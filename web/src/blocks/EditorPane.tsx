import { useState, type ReactNode } from "react";
import { useTranslation } from "react-i18next";
import type { EditorName } from "../api/types";
import { IconButton } from "../app/controls";
import { Editor } from "./Editor";
import { SearchBar } from "./SearchBar";
import { workspaceOf } from "./workspaces";

/** An editor under its name and tools. */
export function EditorPane({ editor, children }: { editor: EditorName; children?: ReactNode }) {
  const { t } = useTranslation();
  const [searching, setSearching] = useState(false);
  return (
    <section className="editor-pane panel" data-view={editor} aria-labelledby={`${editor}-title`}>
      <header className="pane-head">
        <h2 id={`${editor}-title`} className={`editor-title ${editor}`}>
          {t(`editors.${editor}`)}
        </h2>
        {children}
        <div className="pane-tools">
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
