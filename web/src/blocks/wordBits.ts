/** The 32 bits of each block's word beside the block, from level Words on; the table of words reads them out. */

import { utils, type WorkspaceSvg } from "blockly/core";
import type { CompiledWord, EditorName } from "../api/types";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { colourOf, runsOf } from "../words/bits";
import css from "./blocks.module.css";

const BESIDE_PX = 12;
const BIT_PX = 7.5;
/** A word is two lines of bits, or four where there is less room beside the blocks. */
const WIDE = { bits: 16, linePx: 19 };
const NARROW = { bits: 8, linePx: 15 };
type Shape = typeof WIDE;

const widthOf = ({ bits }: Shape) => bits * BIT_PX;

function element(name: string, attributes: Record<string, string | number>, parent: Element): SVGElement {
  return utils.dom.createSvgElement(name, attributes, parent);
}

function drawn(word: CompiledWord, more: number, { bits: most, linePx }: Shape): SVGElement {
  const group = utils.dom.createSvgElement("g", {});
  let at = 0;
  for (const { field, bits, isSet } of runsOf(word)) {
    for (let left = bits; left; ) {
      const part = left.slice(0, most - (at % most));
      const [x, y] = [(at % most) * BIT_PX, Math.floor(at / most) * linePx];
      const width = part.length * BIT_PX;
      element("rect", { x, y, width: width - 1, height: linePx - 2, style: `fill: ${colourOf(field.name)}` }, group);
      const text = element("text", { x: x + 0.5, y: y + linePx - 5, textLength: width - 2, class: isSet ? css.bitsSet! : css.bitsUnset! }, group);
      text.textContent = part;
      at += part.length;
      left = left.slice(part.length);
    }
  }
  if (more) element("text", { x: 0, y: Math.ceil(32 / most) * linePx + 11, class: css.bitsUnset! }, group).textContent = `×${more + 1}`;
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
    const own = new Map<string, { word: CompiledWord; more: number }>();
    for (const word of words) {
      if (word.part !== editor || !word.block) continue;
      const found = own.get(word.block);
      if (found) found.more += 1;
      else own.set(word.block, { word, more: 0 });
    }
    const blocks = [...own.keys()].flatMap((id) => workspace.getBlockById(id) ?? []);
    const column = Math.max(...workspace.getTopBlocks(false).map((block) => block.getBoundingRectangle().right)) + BESIDE_PX;
    const { width } = workspace.getMetricsManager().getViewMetrics(true);
    const hasColumn = column + widthOf(WIDE) <= width;
    const now: typeof shown = new Map();
    for (const block of blocks) {
      const { word, more } = own.get(block.id)!;
      const { x, y } = block.getRelativeToSurfaceXY();
      const left = hasColumn ? column : x + block.width + BESIDE_PX;
      const shape = left + widthOf(WIDE) <= width ? WIDE : NARROW;
      const key = `${word.hex} ${more} ${shape.bits}`;
      const before = shown.get(block.id);
      const group = before?.key === key ? before.group : drawn(word, more, shape);
      group.setAttribute("transform", `translate(${Math.min(left, Math.max(x + BESIDE_PX, width - widthOf(shape)))} ${y + 4})`);
      now.set(block.id, { key, group });
    }
    layer.replaceChildren(...[...now.values()].map(({ group }) => group));
    shown = now;
  };
  const ask = () => (frame ||= requestAnimationFrame(draw));
  const stop = useStudio.subscribe((studio, before) => studio.compiled !== before.compiled && ask());
  workspace.addChangeListener(ask);
  ask();
  return () => {
    stop();
    workspace.removeChangeListener(ask);
    cancelAnimationFrame(frame);
  };
}
