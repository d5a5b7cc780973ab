/** The blocks of an editor as a picture, for a file and for printing. */

import { svgResize, utils, type WorkspaceSvg } from "blockly/core";
import { useSettings } from "../state/settings";
import css from "./blocks.module.css";
import { UNSEEN } from "./inView";
import { liveWorkspaces } from "./workspaces";

interface BlocksPicture {
  svg: string;
  width: number;
  height: number;
}

const MARGIN = 16;
const PNG_SCALE = 2;

/** The style sheets that colour the blocks; rules of other elements do no harm in the picture. */
function blocklyStyles(): string {
  const rules = [...document.querySelectorAll("style")].map((style) => style.textContent);
  return rules.filter((text) => text.includes("blockly")).join("\n");
}

export function pictureOf(workspace: WorkspaceSvg): BlocksPicture {
  svgResize(workspace);
  const box = workspace.getBlocksBoundingBox();
  const width = Math.ceil(box.right - box.left + 2 * MARGIN);
  const height = Math.ceil(box.bottom - box.top + 2 * MARGIN);
  const canvas = workspace.getCanvas().cloneNode(true) as SVGGElement;
  // A picture is as large as the blocks.
  canvas.querySelector(`.${css.bits!}`)?.remove();
  for (const each of canvas.querySelectorAll(`.${UNSEEN}`)) each.classList.remove(UNSEEN);
  canvas.setAttribute("transform", `translate(${MARGIN - box.left} ${MARGIN - box.top})`);
  const { createSvgElement, SVG_NS } = utils.dom;
  // The theme's rules begin with the classes of the editor's own elements.
  const own = workspace.getInjectionDiv().getAttribute("class") ?? "";
  const svg = createSvgElement("svg", { xmlns: SVG_NS, viewBox: `0 0 ${width} ${height}`, width, height, class: own });
  createSvgElement("style", {}, svg).textContent = blocklyStyles();
  createSvgElement("rect", { width: "100%", height: "100%", fill: "#fff" }, svg);
  svg.append(canvas);
  return { svg: new XMLSerializer().serializeToString(svg), width, height };
}

export async function pngOf({ svg, width, height }: BlocksPicture): Promise<Blob> {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  canvas.width = width * PNG_SCALE;
  canvas.height = height * PNG_SCALE;
  canvas.getContext("2d")!.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png");
  });
}

function showPictures(): void {
  document.documentElement.dataset.theme = "light";
  for (const [, workspace] of liveWorkspaces()) {
    const picture = new DOMParser().parseFromString(pictureOf(workspace).svg, "image/svg+xml").documentElement;
    picture.classList.add(css.printed!);
    workspace.getInjectionDiv().parentElement?.after(document.adoptNode(picture));
  }
}

function removePictures(): void {
  document.documentElement.dataset.theme = useSettings.getState().theme;
  for (const picture of document.querySelectorAll(`.${css.printed!}`)) picture.remove();
}

/** While the page is printed, show each editor as a picture of all its blocks, in light colours. */
export function startPrinting(): void {
  window.addEventListener("beforeprint", showPictures);
  window.addEventListener("afterprint", removePictures);
}
