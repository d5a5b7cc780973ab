/** Paper has no scrollbars: while the page is printed, each editor is a picture of all its blocks, on a light ground. */

import { useSettings } from "../app/settings";
import { pictureOf } from "./picture";
import { liveWorkspaces } from "./workspaces";

const PRINTED = "printed-blocks";

function begin(): void {
  document.documentElement.dataset.theme = "light";
  for (const [, workspace] of liveWorkspaces()) {
    const picture = new DOMParser().parseFromString(pictureOf(workspace).svg, "image/svg+xml").documentElement;
    picture.classList.add(PRINTED);
    workspace.getInjectionDiv().parentElement?.after(document.adoptNode(picture));
  }
}

function end(): void {
  document.documentElement.dataset.theme = useSettings.getState().theme;
  for (const picture of document.querySelectorAll(`.${PRINTED}`)) picture.remove();
}

export function printWholeBlocks(): void {
  window.addEventListener("beforeprint", begin);
  window.addEventListener("afterprint", end);
}
