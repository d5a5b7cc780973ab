/** Ask a server that stopped answering until it answers again, and load what the page needs of it. */

import { useStudio } from "../state/studio";
import * as api from "./http";

const EVERY_MS = 1500;

export function watchPresence(onBack: () => void): void {
  let asking = false;
  const ask = async () => {
    const back = await fetch("/api/capabilities", { method: "POST", cache: "no-store" }).then(
      (response) => response.ok,
      () => false,
    );
    if (!back) {
      setTimeout(() => void ask(), EVERY_MS);
      return;
    }
    asking = false;
    useStudio.setState({ serverGone: false });
    onBack();
  };
  useStudio.subscribe(({ serverGone }) => {
    if (!serverGone || asking) return;
    asking = true;
    setTimeout(() => void ask(), EVERY_MS);
  });
}

/** What the page needs from the server before anything can be drawn. */
export async function loadFigures(): Promise<void> {
  const name = useStudio.getState().profile;
  const [capabilities, formats, profiles] = await Promise.all([api.capabilities(), api.formats(), api.profiles()]);
  const profileFigures = profiles.find((profile) => profile.name === name) ?? null;
  useStudio.setState({ capabilities, formats, profileFigures });
}
