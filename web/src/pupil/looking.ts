/** The teacher looks at a pupil's project: a copy of it, in a tab of its own. */

import { askTeacher } from "../classroom/ask";
import type { OpenedProject } from "../api/types";
import type { StoredWork } from "../projects/autosave";
import { useStudio } from "../state/studio";

/** The pupil's id, and the name of the project; an empty one for the draft. */
export interface Looking {
  pupil: string;
  project: string;
}

/** What an address of the studio says of a pupil's project: `/?pupil=01&project=Robot`. */
export function lookingIn(search: string): Looking | null {
  const asked = new URLSearchParams(search);
  const pupil = asked.get("pupil");
  return pupil ? { pupil, project: asked.get("project") ?? "" } : null;
}

/** Which project this tab shows to the teacher; null for a studio of one's own. */
export const looking = () => (useStudio.getState().capabilities?.classroom === "teacher" ? lookingIn(location.search) : null);

/** A copy of a pupil's project. Throws RefusedError or UnreachableError. It is not in the teacher's library, so it has no version there. */
export async function lookAt({ pupil, project }: Looking): Promise<StoredWork> {
  const found: OpenedProject = await askTeacher("project", { pupil, name: project });
  // This browser keeps nothing of it; who leaves with changes is asked.
  window.addEventListener("beforeunload", (event) => useStudio.getState().unsaved && event.preventDefault());
  return { ...found, name: found.name ?? "", version: undefined, parkedFollowers: null, unsaved: false, stored: true, at: Date.now() };
}
