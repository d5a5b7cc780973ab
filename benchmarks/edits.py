"""Edit a block in a browser, and let the page itself note how long its words took.

The time begins with the time stamp of the key that is typed into a field: the browser sets it before the page knows of
the key, so that waiting for other work of the page counts. The page gets one listener of keys and one observer of its
words. Nothing asks the page while it works: a message of its console says that the edit is shown. The place of the
field is found once, before. Between its actions a user pauses, and so do these edits.
"""

from collections.abc import Iterator
from statistics import median, quantiles

from playwright.sync_api import Page
from swarm import result

EDITS, LUCK_EDITS, WARM_EDITS = 60, 30, 5
# Fast users type, and begin the next edit, about so soon.
PAUSE_MS = 150
SHOWN = "motorcade: the words of an edit are shown"
# Note, in ms, when a word was another one in the document, and when the picture with it was drawn: what a picture posts
# runs after it.
NOTE_EDITS = f"""() => {{
    const times = (window.editTimes = {{ words: [], shown: [] }})
    const {{ port1, port2 }} = new MessageChannel()
    let typed = null
    let edit = null
    port1.onmessage = () => {{
        times.shown.push(performance.now() - edit)
        console.debug("{SHOWN}")
    }}
    addEventListener("keydown", ({{ key, timeStamp }}) => {{ if (/^\\d$/.test(key)) typed = timeStamp }}, true)
    new MutationObserver(() => {{
        if (typed === null) return
        edit = typed
        typed = null
        times.words.push(performance.now() - edit)
        requestAnimationFrame(() => port2.postMessage(null))
    }}).observe(document.body, {{ subtree: true, attributeFilter: ["data-hex"] }})
}}"""
EDIT_TIMES = "() => window.editTimes"


# The meter below the goals of a mission, and the same while the program is still tried on other seeds.
METER = "[aria-describedby=luck-more] [role=meter]"
TRYING = f"{METER}:not([data-done])"

Rows = Iterator[tuple[str, str, str, str]]


def edit_rows(page: Page, goal_ms: float) -> Rows:
    """Change the seconds of the only wait of a program in the open page; return the rows of the table."""
    page.get_by_role("tab", name="Words", exact=True).click()
    page.get_by_text("255 of 255").wait_for()
    page.evaluate(NOTE_EDITS)
    place = place_of_wait(page)
    for edit in range(WARM_EDITS + EDITS):
        change_wait(page, place, "23"[edit % 2])
    yield from rows_of(page, "edit to words, 255 steps", EDITS, goal_ms)


def luck_edit_rows(page: Page, goal_ms: float) -> Rows:
    """Change the only wait of a mission's program, which waits 2 s, each time that its luck meter runs again.

    The mission is that of `certainty`, and it plays. Its meter is there when a run has ended: the first ends sooner.
    """
    page.get_by_role("tab", name="Words", exact=True).click()
    choose_speed(page, "16×")
    page.locator(METER).wait_for()
    choose_speed(page, "1×")
    page.evaluate(NOTE_EDITS)
    change_wait(page, place_of_wait(page), "3")
    page.locator("#mat-play").click()
    for edit in range(WARM_EDITS + LUCK_EDITS):
        page.locator(TRYING).wait_for()
        change_wait(page, place_of_wait(page), "23"[edit % 2])
    yield from rows_of(page, "edit to words while the luck meter runs", LUCK_EDITS, goal_ms)


def choose_speed(page: Page, speed: str) -> None:
    page.get_by_role("button", name="Speed").click()
    page.get_by_role("option", name=speed, exact=True).click()


def place_of_wait(page: Page) -> tuple[float, float]:
    """Where the field is, from the left and the top."""
    # The innermost: each block contains those below it.
    block = page.locator(".blocklyBlockCanvas .blocklyDraggable").filter(has_text="wait").last
    box = block.locator(":scope > .blocklyNumberField").bounding_box()
    assert box
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def change_wait(page: Page, place: tuple[float, float], seconds: str) -> None:
    page.mouse.click(*place)
    page.wait_for_timeout(PAUSE_MS)
    with page.expect_console_message(lambda message: message.text == SHOWN):
        page.keyboard.press(seconds)
    page.wait_for_timeout(PAUSE_MS)
    page.keyboard.press("Enter")
    page.wait_for_timeout(PAUSE_MS)


def rows_of(page: Page, name: str, edits: int, goal_ms: float) -> Rows:
    times = page.evaluate(EDIT_TIMES)
    words, shown = times["words"][-edits:], times["shown"][-edits:]
    late = quantiles(words, n=20)[-1]
    figures = (f"median {median(each):.0f} · 95% {quantiles(each, n=20)[-1]:.0f} ms" for each in (words, shown))
    yield name, next(figures), f"≤ {goal_ms} ms for 95%", result(late, goal_ms, least=False)
    yield "the same, until they are drawn", next(figures), "", ""
