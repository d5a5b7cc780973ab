/**
 * What an editor draws of the blocks in its view alone: their outlines and fields, and from level Words on the 32 bits of
 * each one's word beside it, which the table of words reads out. The browser paints all of an editor anew at each edit.
 */

import { type BlockSvg, utils, type WorkspaceSvg } from "blockly/core";
import type { CompiledWord, EditorName } from "../api/types";
import { isStart } from "../state/settings";
import { useStudio } from "../state/studio";
import { endAll, watchSize } from "../ui/areas";
import { colourOf, runsOf } from "../words/bits";
import { editorWith } from "./workspaces";
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

/** How high the bits of a word are at most. */
const HIGHEST_PX = 50;

export const UNSEEN = "motorcade-unseen";
/** A view scrolls so far, in its own height, before the blocks there are drawn. */
const SPARE_VIEWS = 1;

const widthOf = ({ bits, bitPx }: Shape) => bits * bitPx;

const element = utils.dom.createSvgElement;

/** The bits of a word in the colours of their fields, and how often the word comes where that is more than once. */
function drawn(word: CompiledWord, times: number, shape: Shape): SVGElement {
  const { bits: most, bitPx, linePx, fontPx } = shape;
  const group = element("g", { "font-size": fontPx });
  let at = 0;
  for (const { field, bits, isSet } of runsOf(word)) {
    for (let left = bits; left; ) {
      const part = left.slice(0, most - (at % most));
      const [x, y] = [(at % most) * bitPx, Math.floor(at / most) * linePx];
      element("rect", { x, y, width: part.length * bitPx - 1, height: linePx - 1, style: `fill: ${colourOf(field)}` }, group);
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

/** The place of each block. Blockly would read the places of all blocks above it for each. */
function placesOf(workspace: WorkspaceSvg): Map<BlockSvg, { x: number; y: number }> {
  const places = new Map<BlockSvg, { x: number; y: number }>();
  for (const top of workspace.getTopBlocks(false)) places.set(top, top.getRelativeToSurfaceXY());
  // A map's loop comes to what is added in it, too.
  for (const [block, { x, y }] of places) {
    for (const inner of block.getChildren(false)) {
      const own = utils.svgMath.getRelativeXY(inner.getSvgRoot());
      places.set(inner, { x: x + own.x, y: y + own.y });
    }
  }
  return places;
}

/**
 * Paint nothing of a block that is out of view, or paint it again. Its elements keep their places: the keyboard still
 * finds them, and Blockly measures them. Each gets the class itself, as a selector from block to outline would restyle
 * all blocks below.
 */
function setUnseen(block: BlockSvg, unseen: boolean): void {
  (block.pathObject as { svgPath?: SVGElement }).svgPath?.classList.toggle(UNSEEN, unseen);
  for (const input of block.inputList) for (const field of input.fieldRow) field.getSvgRoot()?.classList.toggle(UNSEEN, unseen);
}

/** Draw an editor's blocks, and the bits of their words, where they are in view; returns a function that ends this. */
export function drawInView(editor: EditorName, workspace: WorkspaceSvg): () => void {
  const layer = element("g", { class: css.bits!, "aria-hidden": "true" }, workspace.getCanvas());
  /** What is drawn, by block. */
  const shown = new Map<string, { key: string; place: string; group: SVGElement }>();
  let unseen = new Set<BlockSvg>();
  let frame = 0;

  const draw = () => {
    frame = 0;
    const words = isStart() ? [] : (useStudio.getState().compiled?.words ?? []);
    const own = new Map<string, { word: CompiledWord; times: number }>();
    for (const word of words) {
      if (!word.block || (word.part !== editor && editorWith(word.part as EditorName, word.block) !== editor)) continue;
      const found = own.get(word.block);
      if (found) found.times += 1;
      else own.set(word.block, { word, times: 1 });
    }
    const view = workspace.getMetricsManager().getViewMetrics(true);
    const room = view.width - BAR_PX;
    // One below another, or else each beside its own block; where there is no room for that either the table shows them.
    const fitting = (left: number) => SHAPES.find((shape) => left + widthOf(shape) <= room);
    const places = placesOf(workspace);
    const column = Math.max(0, ...[...places].map(([{ width }, { x }]) => x + width)) + BESIDE_PX;
    const shared = fitting(column);
    const left = new Set(shown.keys());
    const [top, bottom] = [view.top - SPARE_VIEWS * view.height, view.top + (1 + SPARE_VIEWS) * view.height];
    const unseenBefore = unseen;
    unseen = new Set();
    for (const [block, { x, y }] of places) {
      const isUnseen = y > bottom || y + block.height < top;
      if (isUnseen) unseen.add(block);
      if (isUnseen !== unseenBefore.has(block)) setUnseen(block, isUnseen);
      const needed = own.get(block.id);
      // A program of 255 blocks has thousands of digits.
      if (!needed || y > view.top + view.height || y + HIGHEST_PX < view.top) continue;
      const beside = shared ? column : x + block.width + BESIDE_PX;
      const shape = shared ?? fitting(beside);
      if (!shape) continue;
      const times = beside + widthOf(shape) + TIMES_PX <= room ? needed.times : 1;
      const key = `${needed.word.hex} ${times} ${shape.bits}`;
      const place = `translate(${beside} ${y + 2})`;
      const before = shown.get(block.id);
      const group = before?.key === key ? before.group : drawn(needed.word, times, shape);
      // What is touched is laid out again, also where nothing changes.
      if (group !== before?.group) {
        before?.group.remove();
        layer.append(group);
      }
      if (group !== before?.group || place !== before.place) group.setAttribute("transform", place);
      shown.set(block.id, { key, place, group });
      left.delete(block.id);
    }
    for (const id of left) {
      shown.get(id)!.group.remove();
      shown.delete(id);
    }
  };
  const ask = () => (frame ||= requestAnimationFrame(draw));
  workspace.addChangeListener(ask);
  ask();
  return endAll(
    useStudio.subscribe((studio, before) => studio.compiled !== before.compiled && ask()),
    watchSize(workspace.getInjectionDiv(), ask),
    () => workspace.removeChangeListener(ask),
    () => cancelAnimationFrame(frame),
  );
}
