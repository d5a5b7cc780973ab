/** All projects of the library to one file, and from such a file into the library. */

import i18next from "i18next";
import { textOf } from "../api/fileText";
import { request } from "../api/service";
import { notify } from "../state/dialogs";
import { chooseFile, download } from "../ui/files";
import { attempt } from "./actions";

/** The service takes no larger file. */
const MOST_MB = 32;

/** Download all projects with all versions and the stars as one file. */
export function exportAll(): Promise<void> {
  return attempt(async () => {
    const [{ text, left_out }, projects] = await Promise.all([request("projects/export"), request("projects/list")]);
    const day = new Date().toISOString().slice(0, 10);
    download(`motorcade ${day}.projects.json`, text, "application/json");
    notify(i18next.t("library.exported", { count: projects.length }), "success");
    const damaged = left_out.map(({ name, version }) => `${name} ${version}`);
    if (damaged.length) notify(i18next.t("library.leftOut", { names: listed(damaged) }), "warning");
  });
}

/** Add the projects of a file that the user chooses, and say what was added. */
export function importAll(): Promise<void> {
  return attempt(async () => {
    const file = await chooseFile(".json,application/json");
    if (!file) return;
    if (file.size > MOST_MB << 20) {
      notify(i18next.t("library.tooLarge", { most: MOST_MB }), "error");
      return;
    }
    const { projects, stars, left_out } = await request("projects/import", { text: await textOf(file) });
    const count = projects.reduce((sum, { versions }) => sum + versions, 0);
    const sentences = [i18next.t(count ? "library.imported" : "library.importedNothing", { count })];
    for (const { name, stored_as } of projects) {
      if (stored_as !== name) sentences.push(i18next.t("library.importedAs", { name, as: stored_as }));
    }
    if (stars) sentences.push(i18next.t("library.importedStars", { count: stars }));
    if (left_out.length) sentences.push(i18next.t("library.importedLeftOut", { names: listed(left_out) }));
    notify(sentences.join(" "), left_out.length ? "warning" : "success");
  });
}

/** A few names; a sentence can't hold hundreds. */
function listed(names: readonly string[]): string {
  const most = 5;
  const some = names.length > most ? [...names.slice(0, most), "…"] : names;
  return new Intl.ListFormat(i18next.language, { type: "unit" }).format(some);
}
