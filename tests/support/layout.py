"""What keeps people from using a page: parts that don't fit a window or are covered, and barriers that axe finds."""

from playwright.sync_api import Page
from scripts.studio_process import ROOT

from support.soak import SOAK

# Each size of a window that the pages are made for, and those of them that belong to devices without a mouse.
SIZES = ((390, 844), (768, 1024), (820, 1180), (1024, 768), (1366, 768), (1440, 900))
TOUCHED = SIZES[:4]
# For `make test`: the smallest upright and the smallest across.
FEW = SIZES if SOAK else (SIZES[0], SIZES[3])

_FAULTS = """() => {
  const faults = [];
  const tall = document.documentElement;
  if (tall.scrollWidth > innerWidth) faults.push(`the page is ${tall.scrollWidth} px wide`);
  const named = (part) => {
    const name = part.getAttribute("aria-label") ?? part.innerText ?? part.value ?? "";
    return `${part.tagName.toLowerCase()} '${name.trim().slice(0, 40)}'`;
  };
  const modal = [...document.querySelectorAll("[role=dialog], [role=alertdialog], [role=menu], dialog[open]")].at(-1);
  const sheet = modal?.matches("[role=menu]") ? null : modal?.getBoundingClientRect();
  const parts = (modal ?? document).querySelectorAll(`
    button, a[href]:not([href^="#"]), label, select, textarea, summary,
    input:not([type=radio], [type=checkbox], [type=range], [readonly]), output,
    [role=tab], [role=menuitem], [role=menuitemradio], [role=treeitem]`);
  for (const part of parts) {
    if (!part.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    if (part.closest("[inert], [aria-hidden=true]") || part.matches(":disabled")) continue;
    const box = part.getBoundingClientRect();
    if (box.width < 4 || box.height < 4) continue;
    if (sheet && (box.left < sheet.left + 4 || box.right > sheet.right - 4))
      faults.push(`${named(part)} touches the edge of its dialog`);
    let [left, top, right, bottom] = [0, 0, innerWidth, innerHeight], scrolls = false;
    for (let around = part.parentElement; around; around = around.parentElement) {
      const { overflowX, overflowY, position } = getComputedStyle(around);
      if (overflowX === "visible" && overflowY === "visible") continue;
      const outer = around.getBoundingClientRect();
      // What can be scrolled to is in reach.
      scrolls ||= /auto|scroll/.test(overflowY) && around.scrollHeight > around.clientHeight + 1;
      scrolls ||= /auto|scroll/.test(overflowX) && around.scrollWidth > around.clientWidth + 1;
      left = Math.max(left, outer.left), top = Math.max(top, outer.top);
      right = Math.min(right, outer.right), bottom = Math.min(bottom, outer.bottom);
    }
    const isIn = box.left >= left - 2 && box.top >= top - 2 && box.right <= right + 2 && box.bottom <= bottom + 2;
    if (!isIn) {
      if (!scrolls && tall.scrollHeight <= innerHeight) faults.push(`${named(part)} is cut off`);
      continue;
    }
    const over = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
    // A hint goes when the mouse moves on.
    if (!over || !(part.contains(over) || part.control?.contains(over) || over.closest("[role=tooltip]")))
      faults.push(`${named(part)} is covered by ${over ? named(over) + "." + over.className : "nothing"}`);
    const text = part.matches("input") || part.innerText ? part : null;
    if (text && part.scrollWidth > part.clientWidth + 1 && getComputedStyle(part).textOverflow !== "ellipsis")
      faults.push(`the text of ${named(part)} is cut off`);
  }
  const blocks = document.querySelector("#leader-blocks");
  if (blocks?.checkVisibility({ visibilityProperty: true })) {
    const { width, height } = blocks.getBoundingClientRect();
    if (width < 300 || height < 260) faults.push(`blocks have ${Math.round(width)} × ${Math.round(height)} px`);
  }
  return faults;
}"""


class Windows:
    """A page in windows of several sizes, one after another."""

    def __init__(self, page: Page, sizes: tuple[tuple[int, int], ...] = FEW) -> None:
        self._page, self._sizes = page, sizes
        self._device = page.context.new_cdp_session(page)

    def faults(self, state: str) -> list[str]:
        """What is wrong in each window with the page as it shows now, as sentences.

        Nothing may be wider than the window. Each control that can't be scrolled to is wholly in the window, has
        nothing above its centre, and shows all of its text. Blocks have room for the widest one beside the palette, and
        for the hat with two blocks.
        """
        found, before = [], self._page.viewport_size
        for width, height in self._sizes:
            self._device.send("Emulation.setTouchEmulationEnabled", {"enabled": (width, height) in TOUCHED})
            self._page.set_viewport_size({"width": width, "height": height})
            wait_for_picture(self._page)
            found += [f"{state}, {width}×{height}: {fault}" for fault in self._page.evaluate(_FAULTS)]
        if before and before != self._page.viewport_size:
            self._page.set_viewport_size(before)
        return found


_AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
_SERIOUS = """async () => (await axe.run()).violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .flatMap(({ id, nodes }) => nodes.map(({ target, failureSummary }) => `${id}: ${target}: ${failureSummary}`))"""


def serious_barriers(page: Page) -> list[str]:
    """Each barrier on the page as it is now."""
    # Blockly names a field anew with the picture that shows its new text.
    wait_for_picture(page)
    # What fades in has not its own colours yet.
    page.evaluate("() => Promise.allSettled(document.getAnimations().map(({ finished }) => finished))")
    if not page.evaluate("() => 'axe' in window"):
        # As a part of the test's own script, which the page's policy doesn't bind.
        page.evaluate(_AXE.read_text(encoding="utf-8"))
    return list(page.evaluate(_SERIOUS))


def wait_for_picture(page: Page) -> None:
    """Wait until what Blockly does with the next picture is done."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
