import { useState } from "react";
import { request } from "../api/service";
import { say, useTexts } from "../i18n";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { base64Of, download, fileName } from "../ui/files";
import { notify, openDialog } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { Entry, MenuButton } from "../ui/controls";
import { ToolButton } from "../ui/fields";
import { film, filmKind } from "./film";

const FILM_S = 10;

/** The run on paper, its events as a table, and its last seconds as a film. */
export function Downloads() {
  const t = useTexts();
  const isEmpty = useMat(({ state }) => !state?.t_ms);
  const capabilities = useStudio((studio) => studio.capabilities);
  const [filming, setFilming] = useState(false);
  // The service has it at an address, or the page makes it.
  const table = capabilities?.downloads ? { href: `/api/world/${session.name}/timeline.csv`, download: "timeline.csv" } : { onAction: () => void saveTable() };
  const saveFilm = () => {
    setFilming(true);
    void saveStageFilm().finally(() => setFilming(false));
  };
  return (
    <MenuButton
      button={<ToolButton icon="download" wide label={t("timeline.download")} isDisabled={isEmpty || filming} />}
      aria-label={t("timeline.download")}
    >
      <Entry onAction={() => openDialog("run")}>{t("run.open")}</Entry>
      <Entry {...table}>{t("timeline.csv")}</Entry>
      {filmKind() && <Entry onAction={saveFilm}>{t("timeline.film", { count: FILM_S })}</Entry>}
    </MenuButton>
  );
}

function saveTable(): Promise<void> {
  return attempt(async () => {
    const { text } = await request("event-table", { rows: base64Of(session.events.bytes()) });
    download("timeline.csv", text, "text/csv;charset=utf-8");
  });
}

async function saveStageFilm(): Promise<void> {
  const kind = filmKind();
  const stage = document.querySelector<HTMLCanvasElement>("#stage canvas");
  if (!kind || !stage) return;
  notify(say("timeline.filming", { count: FILM_S }));
  try {
    const made = await film(stage, kind.type, FILM_S);
    download(fileName(useStudio.getState().name, kind.ending), made, kind.type);
  } catch {
    // A browser can say that it makes a kind of film, and then not make it.
    notify(say("timeline.noFilm"), "error");
  }
}
