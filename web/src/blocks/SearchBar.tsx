import { useState } from "react";
import { Input, SearchField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { EditorName } from "../api/types";
import { IconButton } from "../app/controls";
import { findBlocks } from "./search";
import { revealBlock, showBlock, workspaceOf } from "./workspaces";

/** Finds blocks by what they say and steps through them. */
export function SearchBar({ editor, onClose }: { editor: EditorName; onClose: () => void }) {
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
    <div className="search-bar" role="search">
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
      <span className="search-count" role="status">
        {query && (found.length ? t("search.count", { at: at + 1, of: found.length }) : t("search.none"))}
      </span>
      <IconButton icon="up" label={t("search.previous")} onPress={() => step(-1)} isDisabled={found.length === 0} />
      <IconButton icon="down" label={t("search.next")} onPress={() => step(1)} isDisabled={found.length === 0} />
      <IconButton icon="close" label={t("search.close")} onPress={leave} />
    </div>
  );
}
