/** The check of all work, or of files from elsewhere, against a mission. */

import { useEffect, useEffectEvent, useId, useState } from "react";
import { textOf } from "../api/fileText";
import type { ClassProgress } from "../generated/classroom";
import { MOST_BYTES, MOST_FILES } from "../generated/classroom";
import { inLanguage, useLanguage, useTexts } from "../i18n";
import { listen } from "../ui/areas";
import { chooseFile, chooseFiles, choosesFolders, download, fileName } from "../ui/files";
import { Action, Problem } from "../ui/page";
import { useAttempt } from "./attempt";
import { askReport, type ReportOrder } from "./ask";
import css from "./class.module.css";
import { chosenFiles, droppedFiles, type Found, readWork, refusal, workOf } from "./workFiles";

/** The missions as choices of a list. */
export function MissionOptions({ missions }: { missions: ClassProgress["missions"] }) {
  return missions.map(({ id, name }) => (
    <option key={id} value={id}>
      {inLanguage(name)}
    </option>
  ));
}

/** Whether files are dragged over the page; calls back with those that are dropped on it, wherever. */
function useDrop(onDrop: (data: DataTransfer) => void): boolean {
  const [over, setOver] = useState(false);
  const drop = useEffectEvent(onDrop);
  useEffect(
    () =>
      listen(window, ["dragover", "dragleave", "drop"], (event: DragEvent) => {
        const { type, dataTransfer, relatedTarget } = event;
        if (!dataTransfer?.types.includes("Files")) return;
        // Else the browser would open the file in place of this page.
        if (type !== "dragleave") event.preventDefault();
        if (type === "dragover") setOver(true);
        else if (type === "drop" || !relatedTarget) setOver(false);
        if (type === "drop") drop(dataTransfer);
      }),
    [],
  );
  return over;
}

/** Check all work against a mission, one of the built-in or one in a file; or files from elsewhere in place of the work. */
export function Report({ missions }: { missions: ClassProgress["missions"] }) {
  const t = useTexts("class");
  const language = useLanguage();
  const [mission, setMission] = useState(missions[0]?.id ?? "");
  const { problem, attempt } = useAttempt();
  const [checking, setChecking] = useState(false);
  const [status, setStatus] = useState("");
  const [refused, setRefused] = useState("");
  const elsewhere = useId();

  const check = async (name: string, order: ReportOrder, unread: readonly string[] = []) => {
    setChecking(true);
    setRefused("");
    const checked = await attempt(async () => download(fileName(name, "-report.html"), await askReport(order, language), "text/html"));
    setChecking(false);
    setStatus(checked ? t("checkDone", { name: fileName(name, "-report.html") }) : "");
    if (unread.length > 0) setRefused(t("checkUnread", { names: unread.join(", ") }));
  };
  const checkAll = (name: string, order: ReportOrder) => {
    setStatus(t("checking"));
    return check(name, order);
  };
  const checkOwn = async () => {
    const file = await chooseFile(".json,.toml,application/json");
    if (!file) return;
    const text = await textOf(file).catch(() => null);
    if (text === null) setRefused(t("checkUnread", { names: file.name }));
    else await checkAll(file.name.split(".")[0]!, { text });
  };
  const checkFiles = async (found: readonly Found[]) => {
    const why = refusal(found);
    if (why) {
      setStatus("");
      setRefused(t(why, { files: MOST_FILES.toLocaleString(language), megabytes: MOST_BYTES >> 20 }));
      return;
    }
    setStatus(t("checkingFiles", { count: workOf(found).length }));
    const { files, unread } = await readWork(found);
    if (files.length > 0) await check(mission, { mission, files }, unread);
    else setRefused(t("checkUnread", { names: unread.join(", ") }));
  };
  const choose = async (folder: boolean) => {
    const chosen = await chooseFiles("", { multiple: true, webkitdirectory: folder });
    if (chosen.length > 0) await checkFiles(chosenFiles(chosen));
  };
  const over = useDrop((data) => {
    if (!checking) void droppedFiles(data).then(checkFiles);
  });
  return (
    <section className="stack loose" aria-label={t("checkReport")}>
      <p>{t("checkAbout")}</p>
      <div className="wrap">
        <select aria-label={t("checkMission")} value={mission} onChange={({ target }) => setMission(target.value)}>
          <MissionOptions missions={missions} />
        </select>
        <Action onClick={() => void checkAll(mission, { mission })} disabled={checking}>{t("checkReport")}</Action>
        <Action onClick={() => void checkOwn()} disabled={checking}>{t("checkOwn")}</Action>
      </div>
      <div role="group" aria-labelledby={elsewhere} className={css.drop} data-over={over || undefined}>
        <p id={elsewhere}>{t("checkElsewhere")}</p>
        <div className="wrap">
          {choosesFolders() && <Action onClick={() => void choose(true)} disabled={checking}>{t("checkFolder")}</Action>}
          <Action onClick={() => void choose(false)} disabled={checking}>{t("checkFiles")}</Action>
        </div>
      </div>
      <p role="status">{status}</p>
      <Problem text={refused || problem} />
    </section>
  );
}
