/** The 32 bits of each block's word beside the block, from level Words on; the table of words reads them out. */

import { utils, type WorkspaceSvg } from "blockly/core";
import type { CompiledWord, EditorName } from "../api/types";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { watchSize } from "../ui/areas";
import { colourOf, runsOf } from "../words/bits";
import css from "./blocks.module.css";

const BESIDE_PX = 8;
/** What the scroll bar needs at the right. */
const BAR_PX = 4;
const TIMES_PX = 22;
/** A word is two lines of bits, or four where there is less room beside the blocks; both are lower than the lowest block. */
const SHAPES = [
  { bits: 16, bitPx: 8, linePx: 18, fontPx: 12 },
  { bits: 8, bitPx: 7, linePx: 12, fontPx: 11 },
] as const;
type Shape = (typeof SHAPES)[number];

const widthOf = ({ bits, bitPx }: Shape) => bits * bitPx;

function element(name: string, attributes: Record<string, string | number>, parent: Element): SVGElement {
  return utils.dom.createSvgElement(name, attributes, parent);
}

/** The bits of a word in the colours of their fields, and how often the word comes where that is more than once. */
function drawn(word: CompiledWord, times: number, shape: Shape): SVGElement {
  const { bits: most, bitPx, linePx, fontPx } = shape;
  const group = utils.dom.createSvgElement("g", { "font-size": fontPx });
  let at = 0;
  for (const { field, bits, isSet } of runsOf(word)) {
    for (let left = bits; left; ) {
      const part = left.slice(0, most - (at % most));
      const [x, y] = [(at % most) * bitPx, Math.floor(at / most) * linePx];
      element("rect", { x, y, width: part.length * bitPx - 1, height: linePx - 1, style: `fill: ${colourOf(field.name)}` }, group);
      // Each digit at its own place: fonts differ in how wide they are.
      const places = Array.from(part, (_, k) => x + (k + 0.5) * bitPx - 0.5).join(" ");
      element("text", { x: places, y: y + linePx / 2, class: isSet ? css.bitsSet! : css.bitsUnset! }, group).textContent = part;
      at += part.length;
      left = left.slice(part.length);
    }
  }
  const last = { x: widthOf(shape) + TIMES_PX / 2, y: (32 / most - 0.5) * linePx, class: css.bitsUnset! };
  if (times > 1) element("text", last, group).textContent = `×${times}`;
  return group;
}

/** Keep the bits of an editor's words beside its blocks; returns a function that ends this. */
export function showWordBits(editor: EditorName, workspace: WorkspaceSvg): () => void {
  const layer = utils.dom.createSvgElement("g", { class: css.bits!, "aria-hidden": "true" }, workspace.getCanvas());
  /** What is drawn, by block. */
  let shown = new Map<string, { key: string; group: SVGElement }>();
  let frame = 0;

  const draw = () => {
    frame = 0;
    const words = useSettings.getState().level === "start" ? [] : (useStudio.getState().compiled?.words ?? []);
    const own = new Map<string, { word: CompiledWord; times: number }>();
    for (const word of words) {
      if (word.part !== editor || !word.block) continue;
      const found = own.get(word.block);
      if (found) found.times += 1;
      else own.set(word.block, { word, times: 1 });
    }
    const column = Math.max(...workspace.getTopBlocks(false).map((block) => block.getBoundingRectangle().right)) + BESIDE_PX;
    const room = workspace.getMetricsManager().getViewMetrics(true).width - BAR_PX;
    // One below another, or else each beside its own block; where there is no room for that either the table shows them.
    const fitting = (left: number) => SHAPES.find((shape) => left + widthOf(shape) <= room);
    const shared = fitting(column);
    const now: typeof shown = new Map();
    for (const [id, { word, times }] of own) {
      const block = workspace.getBlockById(id);
      if (!block) continue;
      const { x, y } = block.getRelativeToSurfaceXY();
      const left = shared ? column : x + block.width + BESIDE_PX;
      const shape = shared ?? fitting(left);
      if (!shape) continue;
      const told = left + widthOf(shape) + TIMES_PX <= room ? times : 1;
      const key = `${word.hex} ${told} ${shape.bits}`;
      const before = shown.get(id);
      const group = before?.key === key ? before.group : drawn(word, told, shape);
      group.setAttribute("transform", `translate(${left} ${y + 2})`);
      now.set(id, { key, group });
    }
    layer.replaceChildren(...[...now.values()].map(({ group }) => group));
    shown = now;
  };
  const ask = () => (frame ||= requestAnimationFrame(draw));
  const stop = useStudio.subscribe((studio, before) => studio.compiled !== before.compiled && ask());
  workspace.addChangeListener(ask);
  const unwatch = watchSize(workspace.getInjectionDiv(), ask);
  ask();
  return () => {
    stop();
    unwatch();
    workspace.removeChangeListener(ask);
    cancelAnimationFrame(frame);
  };
}
