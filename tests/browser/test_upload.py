"""Uploads report their true outcome, and a car's program is read back."""

import threading
from collections import deque

from playwright.sync_api import expect

from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import WaitingLine
from motorcade.config.profile import built_in_profile
from support.studio_page import StudioPage
from support.studio_programs import FOLLOWED

WORDS = ["02010200", "65800000", "6a800000", "b5000000"]


def test_a_program_is_uploaded_to_the_virtual_car_and_read_back_as_blocks(open_page) -> None:
    upload_and_read_back(open_page(project=FOLLOWED))


def upload_and_read_back(studio: StudioPage) -> None:
    """Upload the project `FOLLOWED`, and read it in another page, which stays."""
    studio.open_dialog("upload")
    dialog = studio.dialog("upload.title")
    dialog.get_by_text("Simulated car", exact=True).click()
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog.get_by_role("status")).to_contain_text("Verified: the car holds this program.")
    dialog.get_by_text("Check that the car received everything").click()
    dialog.get_by_role("button", name="Upload").press("Enter")
    expect(dialog.get_by_role("progressbar")).to_be_visible()
    expect(dialog.locator(":focus")).to_have_count(1)
    expect(dialog.get_by_role("status")).to_contain_text("Sent, not verified.")
    # Escape closes the dialog during an upload, too.
    dialog.get_by_role("button", name="Upload").press("Enter")
    studio.page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

    studio.reopen()
    studio.open_dialog("upload")
    dialog = studio.dialog("upload.title")
    dialog.get_by_text("Simulated car", exact=True).click()
    dialog.get_by_role("button", name="Read back").click()
    dialog.get_by_role("button", name="Open as blocks").click()
    studio.expect_words(WORDS)
    expect(studio.block("followers", "right")).to_be_visible()


class BrowserLine(WaitingLine):
    """The car's end of a serial line, whose other end the page opens as a port of Web Serial."""

    address = "the browser"

    def __init__(self) -> None:
        self._to_car: deque[int] = deque()
        self._to_page: deque[int] = deque()
        self._came = threading.Event()

    def wait(self, seconds: float) -> None:
        self._came.wait(seconds)
        self._came.clear()

    def read(self) -> bytes:
        return bytes(self._to_car.popleft() for _ in range(len(self._to_car)))

    def write(self, data: bytes) -> None:
        self._to_page.extend(data)

    def close(self) -> None:
        pass

    def plug_into(self, studio: StudioPage) -> None:
        """Replace the page's `navigator.serial` by this line."""
        studio.page.expose_function("sendToCar", self._send_to_car)
        studio.page.expose_function("readFromCar", lambda: [self._to_page.popleft() for _ in range(len(self._to_page))])
        studio.page.evaluate(FAKE_SERIAL)

    def _send_to_car(self, data: list[int]) -> None:
        self._to_car.extend(data)
        self._came.set()


FAKE_SERIAL = """() => Object.defineProperty(navigator, "serial", { value: { requestPort: async () => {
    let open = false;
    return window.carPort = Object.assign(new EventTarget(), {
        open: async ({ baudRate }) => { open = baudRate === 115200; },
        close: async () => { open = false; },
        readable: new ReadableStream({ async pull(stream) {
            let bytes = await readFromCar();
            while (bytes.length === 0 && open) {
                await new Promise((wake) => setTimeout(wake, 20));
                bytes = await readFromCar();
            }
            if (bytes.length) stream.enqueue(new Uint8Array(bytes));
        } }),
        writable: new WritableStream({ write: (bytes) => open && sendToCar([...bytes]) }),
    });
} } })"""

PULL = """() => new Promise((done) => {
    const pull = () => {
        if (!document.querySelector("[role=dialog] [role=progressbar]")) return setTimeout(pull, 20)
        window.carPort.dispatchEvent(new Event("disconnect"))
        done()
    }
    pull()
})"""


def test_a_serial_port_of_the_browser_works_both_ways(open_page, tmp_path) -> None:
    studio = open_page(project=FOLLOWED)
    line = BrowserLine()
    line.plug_into(studio)
    with simulated_car(line, ImageStore(tmp_path / "image"), built_in_profile("classroom")):
        studio.open_dialog("upload")
        dialog = studio.dialog("upload.title")
        dialog.get_by_text("A port of this browser").click()
        dialog.get_by_role("button", name="Upload").click()
        expect(dialog.get_by_role("status")).to_contain_text("Verified: the car holds this program.")
        dialog.get_by_role("button", name="Read back").click()
        expect(dialog.get_by_role("status")).to_contain_text("The car sent back 4 words.")
    assert ImageStore(tmp_path / "image").load().hex() == "".join(WORDS)

    # Nobody answers any more, and then somebody pulls the cable.
    dialog.get_by_role("button", name="Read back").click()
    studio.page.evaluate(PULL)
    expect(dialog.get_by_role("alert")).to_contain_text("went away in the middle. Is its cable loose?")
