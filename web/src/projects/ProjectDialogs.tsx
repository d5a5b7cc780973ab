import { useEffect, useState } from "react";
import { Button, Input, Label, TextField } from "react-aria-components";
import { request } from "../api/service";
import type { Example, SavedProject } from "../api/types";
import { inLanguage, useLanguage, useTexts } from "../i18n";
import { type Clip, ClipPicture, loadClips } from "../mat/ClipPicture";
import { closeDialog } from "../state/dialogs";
import { confirm } from "../state/questions";
import { useStudio } from "../state/studio";
import { IconButton, Sheet, TextButton } from "../ui/controls";
import { Form } from "../ui/page";
import { attempt, openSaved, saveToLibrary, shareLink } from "./actions";
import { exportAll, importAll } from "./exchange";
import { replaceBy } from "./project";
import { useAnswer } from "./useAnswer";
import { classes } from "../ui/classes";
import controls from "../ui/controls.module.css";
import css from "../app/dialogs.module.css";

function useMoment(): (moment: string) => string {
  const language = useLanguage();
  const format = new Intl.DateTimeFormat(language, { dateStyle: "medium", timeStyle: "short" });
  return (moment) => format.format(new Date(moment));
}

function Versions({ name }: { name: string }) {
  const t = useTexts();
  const moment = useMoment();
  const [versions] = useAnswer("projects/history", [], { name });
  return (
    <ol className={css.versions} aria-label={t("library.versionsOf", { name })}>
      {versions.map(({ version, saved_at }) => (
        <li key={version} className="row apart">
          <span>{t("library.version", { version, moment: moment(saved_at) })}</span>
          <TextButton small onPress={() => void attempt(() => openSaved(name, version))}>{t("library.restore")}</TextButton>
        </li>
      ))}
    </ol>
  );
}

function Entry({ project: { name, saved_at, versions }, onDeleted }: { project: SavedProject; onDeleted: () => void }) {
  const t = useTexts();
  const moment = useMoment();
  const [unfolded, setUnfolded] = useState(false);
  const remove = async () => {
    const question = { title: t("library.deleteTitle", { name }), text: t("library.deleteText"), yes: t("library.delete") };
    if (!(await confirm(question))) return;
    await attempt(() => request("projects/delete", { name }));
    onDeleted();
  };
  return (
    <li>
      <div className="row">
        <Button className="pick across" onPress={() => void attempt(() => openSaved(name))}>
          <b>{name}</b>
          <span className="quiet small">{moment(saved_at)}</span>
        </Button>
        <TextButton small aria-expanded={unfolded} onPress={() => setUnfolded(!unfolded)}>
          {t("library.versions", { count: versions })}
        </TextButton>
        <IconButton icon="trash" label={t("library.deleteNamed", { name })} onPress={() => void remove()} />
      </div>
      {unfolded && <Versions name={name} />}
    </li>
  );
}

/** The projects of the library, each with every version that was saved. */
export function LibraryDialog() {
  const t = useTexts();
  const name = useStudio((studio) => studio.name);
  const [projects, load] = useAnswer("projects/list", null);
  const [place, askPlace] = useAnswer("projects/place", null);
  const look = () => Promise.all([load(), askPlace()]);
  const save = async () => {
    await saveToLibrary();
    await look();
  };
  return (
    <Sheet title={t("library.title")} wide>
      <Form className={css.beside} onSubmit={() => void save()}>
        <TextField className="column tight fill" value={name} onChange={(text) => useStudio.setState({ name: text })} autoFocus>
          <Label>{t("library.saveAs")}</Label>
          <Input maxLength={80} placeholder={t("project.unnamed")} />
        </TextField>
        <TextButton type="submit" primary isDisabled={!name.trim()}>{t("library.save")}</TextButton>
      </Form>
      {place?.problems.map(({ sentence }) => (
        <p key={sentence.en} role="alert" className="caution">
          {inLanguage(sentence)}
        </p>
      ))}
      {projects?.length === 0 && <p className="quiet">{t("library.empty")}</p>}
      <ul className="stack" aria-label={t("library.list")}>
        {projects?.map((project) => (
          <Entry key={project.name} project={project} onDeleted={() => void load()} />
        ))}
      </ul>
      <footer className={controls.sheetFoot}>
        <TextButton onPress={() => void importAll().then(look)}>{t("library.importAll")}</TextButton>
        <TextButton isDisabled={!projects?.length} onPress={() => void exportAll()}>{t("library.exportAll")}</TextButton>
      </footer>
    </Sheet>
  );
}

function ExampleCard({ example, clip, onOpen }: { example: Example; clip: Clip | undefined; onOpen: () => void }) {
  const t = useTexts();
  const difficulty = t(`examples.difficulties.${example.difficulty}`);
  return (
    <Button className={classes("pick across", css.example)} onPress={onOpen}>
      {({ isHovered, isFocusVisible }) => (
        <>
          <span className={css.examplePicture}>{clip && <ClipPicture clip={clip} moves={isHovered || isFocusVisible} />}</span>
          <b>{inLanguage(example.title)}</b>
          <span className="quiet small">{inLanguage(example.about)}</span>
          <span className={classes("quiet small", css.exampleFacts)}>
            <span>
              <span aria-hidden="true">
                {"●".repeat(example.difficulty).padEnd(3, "○")}
              </span>{" "}
              {difficulty}
            </span>
            {clip && <span>{t("examples.cars", { count: clip.cars })}</span>}
          </span>
        </>
      )}
    </Button>
  );
}

/** Programs to begin with. */
export function ExamplesDialog() {
  const t = useTexts();
  const [examples] = useAnswer("examples", []);
  // Where the pictures can't be fetched, the names are enough.
  const [clips, setClips] = useState<ReadonlyMap<string, Clip>>(new Map());
  useEffect(() => void loadClips().then(setClips, () => undefined), []);
  const openExample = (example: Example) =>
    attempt(async () => {
      const project = await request("example", { name: example.id });
      closeDialog();
      await replaceBy({ ...project, name: inLanguage(example.title) });
    });
  return (
    <Sheet title={t("examples.title")} wide>
      <p className="quiet">{t("examples.about")}</p>
      <ul className={css.examples}>
        {examples.map((example) => (
          <li key={example.id}>
            <ExampleCard example={example} clip={clips.get(example.id)} onOpen={() => void openExample(example)} />
          </li>
        ))}
      </ul>
    </Sheet>
  );
}

/** A link that holds the project itself. */
export function ShareDialog() {
  const t = useTexts();
  const [link, setLink] = useState("");
  const [copied, setCopied] = useState(false);
  useEffect(() => void attempt(async () => setLink(await shareLink())), []);
  // Browsers give it to secure pages alone: those of this computer, and by HTTPS.
  const { clipboard } = navigator as Partial<Navigator>;
  const copy = () =>
    clipboard?.writeText(link).then(
      () => setCopied(true),
      () => setCopied(false),
    );
  return (
    <Sheet title={t("share.title")}>
      <p>{t("share.about")}</p>
      <div className={css.beside}>
        <TextField className="column tight fill" value={link} isReadOnly>
          <Label>{t("share.link")}</Label>
          <Input onFocus={(event) => event.target.select()} />
        </TextField>
        {clipboard && (
          <TextButton primary onPress={() => void copy()} isDisabled={!link}>{t("share.copy")}</TextButton>
        )}
      </div>
      <p role="status" className="quiet">
        {copied ? t("share.copied") : t("share.length", { count: link.length })}
      </p>
    </Sheet>
  );
}
