/** All projects of the library to one file, and from such a file into the library. */

import { textOf } from "../api/fileText";
import { request } from "../api/service";
import { languageNow, say } from "../i18n";
import { notify } from "../state/dialogs";
import { chooseFile, download } from "../ui/files";
import { attempt } from "./actions";

/** Download all projects with all versions and the stars as one file. */
export function exportAll(): Promise<void> {
  return attempt(async () => {
    const [{ text, left_out }, projects] = await Promise.all([request("projects/export"), request("projects/list")]);
    const day = new Date().toISOString().slice(0, 10);
    download(`motorcade ${day}.projects.json`, text, "application/json");
    notify(say("library.exported", { count: projects.length }), "success");
    const damaged = left_out.map(({ name, version }) => `${name} ${version}`);
    if (damaged.length) notify(say("library.leftOut", { names: listed(damaged) }), "warning");
  });
}

/** Add the projects of a file that the user chooses, and say what was added. */
export function importAll(): Promise<void> {
  return attempt(async () => {
    const file = await chooseFile(".json,application/json");
    if (!file) return;
    const { projects, stars, left_out } = await request("projects/import", { text: await textOf(file) });
    const count = projects.reduce((sum, { versions }) => sum + versions, 0);
    const sentences = [say(count ? "library.imported" : "library.importedNothing", { count })];
    for (const { name, stored_as } of projects) {
      if (stored_as !== name) sentences.push(say("library.importedAs", { name, as: stored_as }));
    }
    if (stars) sentences.push(say("library.importedStars", { count: stars }));
    if (left_out.length) sentences.push(say("library.importedLeftOut", { names: listed(left_out) }));
    notify(sentences.join(" "), left_out.length ? "warning" : "success");
  });
}

/** A few names; a sentence can't hold hundreds. */
function listed(names: readonly string[]): string {
  const most = 5;
  const some = names.length > most ? [...names.slice(0, most), "…"] : names;
  return new Intl.ListFormat(languageNow(), { type: "unit" }).format(some);
}
