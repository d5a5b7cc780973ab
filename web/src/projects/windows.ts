/** Windows that have the same project of the library open: each tells its user, and none saves over another's version. */

import i18next from "i18next";
import { notify } from "../state/dialogs";
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
  // Without it the library still refuses to save over another window's version.
  if (typeof BroadcastChannel === "undefined") return;
  const channel = new BroadcastChannel(CHANNEL);
  const tell = (is: WindowNews["is"]) => {
    const { base } = useStudio.getState();
    if (base) channel.postMessage({ is, ...base } satisfies WindowNews);
  };
  channel.addEventListener("message", ({ data }: MessageEvent<WindowNews>) => {
    const { base } = useStudio.getState();
    if (base?.name !== data.name) return;
    if (data.is === "open") tell("too");
    if (data.is !== "saved") notify(i18next.t("library.openElsewhere", { name: data.name }), "warning");
    else if (data.version > base.version) notify(i18next.t("library.savedElsewhere", { ...data }), "warning");
  });
  useStudio.subscribe((now, before) => {
    if (now.base === before.base || !now.base) return;
    tell(now.base.name === before.base?.name && now.generation === before.generation ? "saved" : "open");
  });
  tell("open");
}
