/** Looks for a server that is gone until it is back, and tells both. */

import { useStudio } from "../app/store";
import * as api from "./http";

const EVERY_MS = 1500;

export function watchPresence(onBack: () => void): void {
  let looking = false;
  const look = async () => {
    const back = await fetch("/api/formats", { cache: "no-store" }).then(
      (response) => response.ok,
      () => false,
    );
    if (!back) {
      setTimeout(() => void look(), EVERY_MS);
      return;
    }
    looking = false;
    useStudio.setState({ serverGone: false });
    onBack();
  };
  useStudio.subscribe(({ serverGone }) => {
    if (!serverGone || looking) return;
    looking = true;
    setTimeout(() => void look(), EVERY_MS);
  });
}

/** What the page needs from the server before anything can be drawn. */
export async function loadFigures(): Promise<void> {
  const name = useStudio.getState().profile;
  const [formats, profileFigures] = await Promise.all([api.formats(), api.profile(name)]);
  useStudio.setState({ formats, profileFigures });
}
