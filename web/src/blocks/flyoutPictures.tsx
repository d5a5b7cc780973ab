/** Moving pictures in the drawers: above each block, what it makes a car do. */

import * as Blockly from "blockly/core";
import { createRoot, type Root } from "react-dom/client";
import file from "../generated/blockClips.json";
import { ClipPicture } from "../mat/ClipPicture";
import { type Clip, clipsOf } from "../mat/clips";

const KIND = "picture";
const SIZE_PX = { width: 140, height: 70 };
const GAP_PX = 8;
/** A narrower page has no room for them. */
const WIDE_ENOUGH = "(min-width: 700px)";

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
    this.root.render(<ClipPicture clip={clips!.get(this.getButtonText())!} size={SIZE_PX} />);
    Object.assign(this, SIZE_PX);
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

/** To be called once, before a workspace is created. */
export function registerPictures(): void {
  Blockly.registry.register(Blockly.registry.Type.FLYOUT_INFLATER, KIND, PictureInflater, true);
}
