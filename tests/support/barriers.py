"""What keeps some people from using a page, as axe finds it."""

from playwright.sync_api import Page
from scripts.studio_process import ROOT

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
