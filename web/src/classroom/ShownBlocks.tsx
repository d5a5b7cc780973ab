/** The blocks of the pupil whose stage the projector shows, only to be read. It brings Blockly with it: load it where it is shown. */

import * as Blockly from "blockly/core";
import { useEffect, useRef, useState } from "react";
import studioTexts from "virtual:texts/studio";
import { HttpService } from "../api/http";
import { connectTo } from "../api/service";
import { EDITORS, type EditorName, type WorkspaceState } from "../api/types";
import { defineBlocks, setBlocklyLanguage } from "../blocks/definitions";
import { fitAll } from "../blocks/endings";
import { themeOf } from "../blocks/themes";
import type { StoredProject } from "../generated/messages";
import { say, startTexts, useLanguage } from "../i18n";
import { useSettings } from "../state/settings";
import { loadFigures, useStudio } from "../state/studio";
import { endAll, watchSize } from "../ui/areas";
import { askTeacher } from "./ask";
import css from "./class.module.css";

type Programs = Pick<StoredProject, EditorName>;

/** The projector follows a pupil's edits this soon; pupils' pages send a draft at most each second. */
const ASK_EVERY_MS = 2000;
const LARGEST_SCALE = 1.2;

let prepared = false;

/** Get Blockly ready for blocks in the page's language. */
async function prepare(): Promise<void> {
  if (!prepared) {
    connectTo(new HttpService());
    await startTexts(studioTexts);
  }
  prepared = true;
  await loadFigures();
  setBlocklyLanguage();
  defineBlocks(useStudio.getState().profileFigures!);
}

/** The pupil's draft, as it changes; null where there is none. */
function useDraft(pupil: string): Programs | null {
  const [programs, setPrograms] = useState<Programs | null>(null);
  useEffect(() => {
    let shown: string | null = null;
    const ask = async () => {
      const { draft_at } = await askTeacher("library", { pupil });
      if (draft_at === shown) return;
      setPrograms(draft_at === null ? null : await askTeacher("project", { pupil, name: "" }));
      shown = draft_at;
    };
    // While nothing answers, what was shown stays.
    const askAgain = () => void (document.hidden || ask().catch(() => undefined));
    askAgain();
    const timer = setInterval(askAgain, ASK_EVERY_MS);
    return () => clearInterval(timer);
  }, [pupil]);
  return programs;
}

/** One program, as large as its place allows. */
function Program({ editor, state }: { editor: EditorName; state: WorkspaceState }) {
  const host = useRef<HTMLDivElement>(null);
  const workspace = useRef<Blockly.WorkspaceSvg | null>(null);
  const theme = useSettings((settings) => settings.theme);
  useEffect(() => {
    const made = Blockly.inject(host.current!, {
      readOnly: true,
      renderer: "zelos",
      media: `${import.meta.env.BASE_URL}assets/blockly/`,
      sounds: false,
      move: { scrollbars: true, drag: true, wheel: true },
      zoom: { minScale: 0.3, maxScale: LARGEST_SCALE },
    });
    workspace.current = made;
    return endAll(watchSize(host.current!, () => fit(made)), () => made.dispose());
  }, []);
  useEffect(() => workspace.current?.setTheme(themeOf(theme)), [theme]);
  useEffect(() => {
    Blockly.serialization.workspaces.load(state, workspace.current!);
    fitAll(workspace.current!);
    fit(workspace.current!);
  }, [state]);
  return (
    <section className={css.program} aria-label={say(`editors.${editor}Blocks`)}>
      <h2>{say(`editors.${editor}`)}</h2>
      <div className="fill anchor card clip" ref={host} />
    </section>
  );
}

function fit(workspace: Blockly.WorkspaceSvg): void {
  Blockly.svgResize(workspace);
  workspace.zoomToFit();
}

/** A pupil's programs, the leader's and the followers', in the page's language. */
export default function ShownBlocks({ pupil }: { pupil: string }) {
  const language = useLanguage();
  const [ready, setReady] = useState("");
  const programs = useDraft(pupil);
  useEffect(() => void prepare().then(() => setReady(language), () => undefined), [language]);
  if (ready !== language || !programs) return null;
  return (
    <div className="column" key={language}>
      {EDITORS.map((editor) => programs[editor] && <Program key={editor} editor={editor} state={programs[editor]} />)}
    </div>
  );
}
