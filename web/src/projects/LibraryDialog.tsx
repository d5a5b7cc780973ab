import { useCallback, useEffect, useState } from "react";
import { Button, Input, Label, TextField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import * as api from "../api/http";
import type { SavedProject, Version } from "../api/types";
import { confirmed } from "../app/asking";
import { IconButton, Sheet } from "../app/controls";
import { useStudio } from "../app/store";
import { attempt, saveToLibrary } from "./actions";
import { replaceBy } from "./opening";

function useMoment(): (moment: string) => string {
  const { i18n } = useTranslation();
  const format = new Intl.DateTimeFormat(i18n.language, { dateStyle: "medium", timeStyle: "short" });
  return (moment) => format.format(new Date(moment));
}

async function openSaved(name: string, version: number | undefined, onClose: () => void): Promise<void> {
  await attempt(async () => {
    const project = await api.savedProject(name, version);
    onClose();
    await replaceBy({ ...project, name });
  });
}

function Versions({ name, onClose }: { name: string; onClose: () => void }) {
  const { t } = useTranslation();
  const moment = useMoment();
  const [versions, setVersions] = useState<Version[]>([]);
  useEffect(() => void attempt(async () => setVersions(await api.versions(name))), [name]);
  return (
    <ol className="versions" aria-label={t("library.versionsOf", { name })}>
      {versions.map(({ version, saved_at }) => (
        <li key={version}>
          <span>{t("library.version", { version, moment: moment(saved_at) })}</span>
          <Button className="button small" onPress={() => void openSaved(name, version, onClose)}>
            {t("library.restore")}
          </Button>
        </li>
      ))}
    </ol>
  );
}

interface EntryProps {
  project: SavedProject;
  onClose: () => void;
  onDeleted: () => void;
}

function Entry({ project: { name, saved_at, versions }, onClose, onDeleted }: EntryProps) {
  const { t } = useTranslation();
  const moment = useMoment();
  const [unfolded, setUnfolded] = useState(false);
  const remove = async () => {
    const question = { title: t("library.deleteTitle", { name }), text: t("library.deleteText"), yes: t("library.delete") };
    if (!(await confirmed(question))) return;
    await attempt(async () => {
      await api.deleteProject(name);
    });
    onDeleted();
  };
  return (
    <li className="library-entry">
      <div className="library-row">
        <Button className="library-open" onPress={() => void openSaved(name, undefined, onClose)}>
          <b>{name}</b>
          <span>{moment(saved_at)}</span>
        </Button>
        <Button className="button small" aria-expanded={unfolded} onPress={() => setUnfolded(!unfolded)}>
          {t("library.versions", { count: versions })}
        </Button>
        <IconButton icon="trash" label={t("library.deleteNamed", { name })} onPress={() => void remove()} />
      </div>
      {unfolded && <Versions name={name} onClose={onClose} />}
    </li>
  );
}

/** The projects in the server's folder, each with every version that was saved. */
export function LibraryDialog({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const name = useStudio((studio) => studio.name);
  const [projects, setProjects] = useState<SavedProject[] | null>(null);
  const load = useCallback(() => attempt(async () => setProjects(await api.projects())), []);
  useEffect(() => void load(), [load]);
  const save = async () => {
    await saveToLibrary();
    await load();
  };
  return (
    <Sheet title={t("library.title")} onClose={onClose} wide>
      <form
        className="library-save"
        onSubmit={(event) => {
          event.preventDefault();
          void save();
        }}
      >
        <TextField value={name} onChange={(text) => useStudio.setState({ name: text })} autoFocus>
          <Label>{t("library.saveAs")}</Label>
          <Input maxLength={80} placeholder={t("project.unnamed")} />
        </TextField>
        <Button type="submit" className="button primary" isDisabled={!name.trim()}>
          {t("library.save")}
        </Button>
      </form>
      {projects?.length === 0 && <p className="quiet">{t("library.empty")}</p>}
      <ul className="library" aria-label={t("library.list")}>
        {projects?.map((project) => (
          <Entry key={project.name} project={project} onClose={onClose} onDeleted={() => void load()} />
        ))}
      </ul>
    </Sheet>
  );
}
