/** The drawers of blocks: above each block moves a picture of what it does, and beside them the program stays in view. */

import * as Blockly from "blockly/core";
import { createRoot, type Root } from "react-dom/client";
import file from "../generated/blockClips.json";
import { fitEnds } from "./endings";
import { type Clip, ClipPicture, clipsOf } from "../mat/ClipPicture";
import { listen } from "../ui/areas";

const KIND = "picture";
const SIZE_PX = { width: 140, height: 70 };
const GAP_PX = 8;
/** A narrower page, or a lower editor, has no room for them. */
const WIDE_ENOUGH = "(min-width: 700px)";
const HIGH_ENOUGH_PX = 400;
/** From here on a finger shows where it goes: before Blockly takes a block out. */
const SWIPE_PX = 6;
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
    const picture = (
      <foreignObject {...SIZE_PX}>
        <ClipPicture clip={clips!.get(this.getButtonText())!} size={SIZE_PX} />
      </foreignObject>
    );
    if (fits) this.root.render(picture);
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

/** The first gap for a condition: in the selected block, or else in the program. */
function firstGap(hat: Blockly.BlockSvg | undefined): Blockly.Connection | undefined {
  const selected = Blockly.getSelected();
  const blocks = [...(selected instanceof Blockly.BlockSvg ? [selected] : []), ...(hat?.getDescendants(true) ?? [])];
  const inputs = blocks.flatMap((block) => block.inputList).filter((input) => input.type === Blockly.inputs.inputTypes.VALUE);
  return inputs.find((input) => input.isVisible() && !input.connection!.targetBlock())?.connection ?? undefined;
}

/** Blockly keeps the end of a gesture from bubbling. */
function afterGesture(act: () => void): void {
  const once = () => {
    end();
    setTimeout(act);
  };
  const end = listen(window, ["pointerup", "pointercancel"], once, true);
}

/**
 * While a drawer is open, the program is moved out from under it, so that a block can be put there. A block that is only
 * tapped goes to the end of the program.
 */
class Drawer extends Blockly.VerticalFlyout {
  private moved: { from: number; to: number } | null = null;
  /** The blocks that were in the program when the drawer was opened. */
  private known: ReadonlySet<string> = new Set();

  /** All that follows from a tap, or from a drag, is undone together. */
  override createDom(tagName: Parameters<Blockly.VerticalFlyout["createDom"]>[0]): SVGElement {
    const svg = super.createDom(tagName);
    const begin = () => {
      Blockly.Events.setGroup(true);
      afterGesture(() => Blockly.Events.setGroup(false));
    };
    svg.addEventListener("pointerdown", begin, { capture: true });
    svg.addEventListener("pointerdown", (event) => this.followSwipe(event), { capture: true });
    return svg;
  }

  /** A finger that swipes up or down scrolls, also where it begins on a block; Blockly would take the block out. */
  private followSwipe({ pointerId, pointerType, clientX, clientY }: PointerEvent): void {
    if (pointerType !== "touch" || !this.isScrollable()) return;
    const blocks = this.getWorkspace();
    let lastY: number | null = null;
    const move = (event: PointerEvent) => {
      const [across, along] = [event.clientX - clientX, event.clientY - clientY].map(Math.abs);
      if (event.pointerId !== pointerId || Math.max(across!, along!) < SWIPE_PX) return;
      if (lastY === null && across! >= along!) {
        end();
        return;
      }
      if (lastY === null) this.targetWorkspace.cancelCurrentGesture();
      blocks.scroll(blocks.scrollX, blocks.scrollY + event.clientY - (lastY ?? clientY));
      lastY = event.clientY;
    };
    const end = listen(window, ["pointermove"], move, true);
    afterGesture(end);
  }

  override show(contents: Parameters<Blockly.VerticalFlyout["show"]>[0]): void {
    super.show(contents);
    const program = this.targetWorkspace;
    this.known = new Set(program.getAllBlocks(false).map(({ id }) => id));
    const left = program.getBlocksBoundingBox().left * program.scale + program.scrollX;
    const covered = this.getWidth() + BESIDE_PX - left;
    if (covered <= 0 || !program.getAllBlocks(false).length) return;
    const from = this.moved?.from ?? program.scrollX;
    program.scroll(program.scrollX + covered, program.scrollY);
    this.moved = { from, to: program.scrollX };
  }

  override hide(): void {
    const isHand = Blockly.Gesture.inProgress();
    const isTapped = this.isVisible() && isHand && this.appendTapped();
    super.hide();
    // A block that is being dragged keeps its place below the hand.
    if (isTapped || !isHand) this.moveBack(isTapped);
    else {
      const isTaken = this.newBlocks().length > 0;
      afterGesture(() => this.moveBack(isTaken));
    }
  }

  /** The topmost blocks that came out of the drawer since it was opened. */
  private newBlocks(): Blockly.BlockSvg[] {
    return this.targetWorkspace.getTopBlocks(false).filter(({ id }) => !this.known.has(id));
  }

  /**
   * Put blocks that were only tapped, and so have no place yet, below the last one under the hat, and conditions into the
   * first gap; whether there are any.
   */
  private appendTapped(): boolean {
    const program = this.targetWorkspace;
    const tapped = this.newBlocks().filter((block) => !block.isDragging());
    const hat = program.getTopBlocks(false).find((block) => !block.previousConnection);
    for (const block of tapped) {
      if (block.outputConnection) firstGap(hat)?.connect(block.outputConnection);
      const end = hat?.lastConnectionInStack(true);
      if (!end || !block.previousConnection || !end.getConnectionChecker().canConnect(end, block.previousConnection, false)) continue;
      end.connect(block.previousConnection);
      // Once the program is back in its place.
      setTimeout(() => {
        if (!block.isDisposed()) program.scrollBoundsIntoView(block.getBoundingRectangleWithoutChildren());
      });
    }
    return tapped.length > 0;
  }

  /**
   * Move the program back, unless somebody scrolled it meanwhile. Blockly itself scrolls to a block that was tapped, and
   * where there is little room it scrolls when a block is dropped.
   */
  private moveBack(isScrolled: boolean): void {
    if (!this.moved || this.isVisible() || !this.targetWorkspace.rendered) return;
    const { from, to } = this.moved;
    this.moved = null;
    if (isScrolled || this.targetWorkspace.scrollX === to) this.targetWorkspace.scroll(from, this.targetWorkspace.scrollY);
  }
}

/** What a workspace is created with, so that it has such drawers. */
export const DRAWER_PLUGINS = { flyoutsVerticalToolbox: Drawer };

/** The sign of a drawer has the colour of its blocks. */
class DrawerName extends Blockly.ToolboxCategory {
  protected override createIconDom_(): Element {
    const icon = super.createIconDom_() as HTMLElement;
    icon.style.background = this.colour_;
    return icon;
  }
}

/** A drawer hears of no blocks that come: they are fitted when they are made. */
class FittedInflater extends Blockly.BlockFlyoutInflater {
  override load(state: object, flyout: Blockly.IFlyout): Blockly.FlyoutItem {
    const item = super.load(state, flyout);
    const block = item.getElement();
    if (block instanceof Blockly.BlockSvg) {
      fitEnds(block);
      block.render();
    }
    return item;
  }
}

Blockly.registry.register(Blockly.registry.Type.TOOLBOX_ITEM, Blockly.ToolboxCategory.registrationName, DrawerName, true);
Blockly.registry.register(Blockly.registry.Type.FLYOUT_INFLATER, KIND, PictureInflater, true);
Blockly.registry.register(Blockly.registry.Type.FLYOUT_INFLATER, "block", FittedInflater, true);
