/** Windows that have the same project of the library open: each tells its user, and none saves over another's version. */

import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { openChannel } from "../state/otherTabs";
import { useStudio } from "../state/studio";

const CHANNEL = "motorcade.windows";

/** `open`: a window has opened the project; `too`: the sender has it open already; `saved`: it has saved that version. */
interface WindowNews {
  is: "open" | "too" | "saved";
  name: string;
  version: number;
}

/** Tell other windows what this one opens and saves, and tell the user what they do with the same project. */
export function watchOtherWindows(): void {
  // Without a channel the library still refuses to save over another window's version.
  const channel = openChannel(CHANNEL, (news: WindowNews) => {
    const { base } = useStudio.getState();
    if (base?.name !== news.name) return;
    if (news.is === "open") tell("too");
    if (news.is !== "saved") notify(say("library.openElsewhere", { name: news.name }), "warning");
    else if (news.version > base.version) notify(say("library.savedElsewhere", { ...news }), "warning");
  });
  const tell = (is: WindowNews["is"]) => {
    const { base } = useStudio.getState();
    if (base) channel?.postMessage({ is, ...base } satisfies WindowNews);
  };
  useStudio.subscribe((now, before) => {
    if (now.base === before.base || !now.base) return;
    tell(now.base.name === before.base?.name && now.generation === before.generation ? "saved" : "open");
  });
  tell("open");
}
