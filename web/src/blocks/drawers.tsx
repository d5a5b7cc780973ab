/** The drawers of blocks: above each block moves a picture of what it does, and beside them the program stays in view. */

import * as Blockly from "blockly/core";
import { createRoot, type Root } from "react-dom/client";
import file from "../generated/blockClips.json";
import { ClipPicture } from "../mat/ClipPicture";
import { type Clip, clipsOf } from "../mat/clips";

const KIND = "picture";
const SIZE_PX = { width: 140, height: 70 };
const GAP_PX = 8;
/** A narrower page, or a lower editor, has no room for them. */
const WIDE_ENOUGH = "(min-width: 700px)";
const HIGH_ENOUGH_PX = 400;
/** How far the program stays away from an open drawer. */
const BESIDE_PX = 12;

let clips: ReadonlyMap<string, Clip> | null = null;

/** What stands above the block in its drawer, as toolbox contents. */
export function pictureAbove(block: string): { kind: typeof KIND; text: string }[] {
  clips ??= clipsOf(file);
  const kind = block.replace("motorcade_", "");
  return matchMedia(WIDE_ENOUGH).matches && clips.has(kind) ? [{ kind: KIND, text: kind }] : [];
}

/** A label whose text is the kind of block. */
class PictureItem extends Blockly.FlyoutButton {
  private readonly root: Root;

  constructor(...options: ConstructorParameters<typeof Blockly.FlyoutButton>) {
    super(...options);
    const group = this.getSvgRoot();
    group.replaceChildren();
    group.setAttribute("aria-hidden", "true");
    this.root = createRoot(group);
    const fits = this.getTargetWorkspace().getParentSvg().clientHeight >= HIGH_ENOUGH_PX;
    if (fits) this.root.render(<ClipPicture clip={clips!.get(this.getButtonText())!} size={SIZE_PX} />);
    Object.assign(this, fits ? SIZE_PX : { width: 0, height: 0 });
  }

  override canBeFocused(): boolean {
    return false;
  }

  override dispose(): void {
    this.root.unmount();
    super.dispose();
  }
}

class PictureInflater extends Blockly.LabelFlyoutInflater {
  override load(state: object, flyout: Blockly.IFlyout): Blockly.FlyoutItem {
    const item = new PictureItem(flyout.getWorkspace(), flyout.targetWorkspace!, state as Blockly.utils.toolbox.LabelInfo, true);
    item.show();
    return new Blockly.FlyoutItem(item, KIND);
  }

  override gapForItem(): number {
    return GAP_PX;
  }

  override getType(): string {
    return KIND;
  }
}

/** While a drawer is open, the program is moved out from under it, so that a block can be put there. */
class Drawer extends Blockly.VerticalFlyout {
  private moved: { from: number; to: number } | null = null;

  override show(contents: Parameters<Blockly.VerticalFlyout["show"]>[0]): void {
    super.show(contents);
    const program = this.targetWorkspace;
    const left = program.getBlocksBoundingBox().left * program.scale + program.scrollX;
    const covered = this.getWidth() + BESIDE_PX - left;
    if (covered <= 0 || !program.getAllBlocks(false).length) return;
    const from = this.moved?.from ?? program.scrollX;
    program.scroll(program.scrollX + covered, program.scrollY);
    this.moved = { from, to: program.scrollX };
  }

  override hide(): void {
    super.hide();
    // A block that is being dragged keeps its place below the hand.
    const moveBack = () => this.moveBack();
    // Blockly keeps the end of a gesture from bubbling.
    const atItsEnd = { once: true, capture: true };
    if (Blockly.Gesture.inProgress()) addEventListener("pointerup", () => setTimeout(moveBack), atItsEnd);
    else moveBack();
  }

  /** Move the program back, unless somebody scrolled it meanwhile. */
  private moveBack(): void {
    if (!this.moved || this.isVisible() || !this.targetWorkspace.rendered) return;
    const { from, to } = this.moved;
    this.moved = null;
    if (this.targetWorkspace.scrollX === to) this.targetWorkspace.scroll(from, this.targetWorkspace.scrollY);
  }
}

/** What a workspace is created with, so that it has such drawers. */
export const DRAWER_PLUGINS = { flyoutsVerticalToolbox: Drawer };

/** To be called once, before a workspace is created. */
export function registerPictures(): void {
  Blockly.registry.register(Blockly.registry.Type.FLYOUT_INFLATER, KIND, PictureInflater, true);
}
