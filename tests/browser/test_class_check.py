"""Files from elsewhere that the teacher has checked: a folder is chosen or dropped, with damaged and foreign files."""

import json

import pytest
from playwright.sync_api import expect

from support.class_visits import class_room
from support.studio_programs import EXAMPLE


@pytest.fixture
def teacher(browser, page_built, tmp_path):
    with class_room(browser, tmp_path / "room") as room:
        yield room.teacher


FROM_ELSEWHERE = {
    "anna/mine.json": json.dumps(EXAMPLE).encode(),
    "bo/mine.py": b"from motorcade import Program, forward\n\nprogram = Program(leader=[forward(2)])\n",
    "bo/damaged.json": json.dumps(EXAMPLE)[:40].encode(),
    "foreign.json": b'{"shopping": ["milk"]}',
    "film.mp4": bytes(2_000_000),
}
# Lets a page be dropped files and folders on, as a browser gives them.
DROP = """files => {
    const bytes = text => Uint8Array.from(text, letter => letter.charCodeAt(0))
    const entry = (path, text) => ({
        isFile: true, fullPath: `/${path}`,
        file: (give, refuse) => text === null ? refuse(new Error()) : give(new File([bytes(text)], path)),
    })
    const folder = (name, some) => ({
        isFile: false, fullPath: `/${name}`,
        createReader: () => {
            const parts = [some.slice(0, 2), some.slice(2)]
            return { readEntries: give => give(parts.shift() ?? []) }
        },
    })
    const all = Object.entries(files).map(([path, text]) => entry(`class/${path}`, text))
    const items = [{ webkitGetAsEntry: () => folder("class", all) }]
    for (const kind of ["dragover", "drop"]) {
        const event = new DragEvent(kind, { bubbles: true, cancelable: true })
        Object.defineProperty(event, "dataTransfer", { value: { types: ["Files"], items, files: [] } })
        document.querySelector("h1").dispatchEvent(event)
        if (!event.defaultPrevented) throw new Error("the browser opens the file in place of the page")
    }
}"""


def expect_report_of(teacher, choose) -> None:
    """Choose files from elsewhere; the report has them by their folders, damaged and foreign ones too."""
    with teacher.page.expect_download() as download:
        choose()
    report = download.value.path().read_text(encoding="utf-8")
    assert [name for name in FROM_ELSEWHERE if f">{name}</th>" not in report] == []
    # The two that are programs have a picture.
    assert report.count("<svg") == 2
    expect(teacher.page.get_by_role("status").filter(has_text=download.value.suggested_filename)).to_be_visible()


def test_a_folder_of_files_from_elsewhere_is_checked_damaged_and_foreign_ones_too(teacher, tmp_path) -> None:
    folder = tmp_path / "class"
    for name, data in {**FROM_ELSEWHERE, ".hidden/anna.json": b"{}", "after-you-report.html": b"old"}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    teacher.part("progress")

    def choose() -> None:
        with teacher.page.expect_file_chooser() as chooser:
            teacher.button("class.checkFolder").press("Enter")
        chooser.value.set_files(folder)

    expect_report_of(teacher, choose)
    with teacher.page.expect_file_chooser() as chooser:
        teacher.button("class.checkFiles").click()
    with teacher.page.expect_download() as download:
        chooser.value.set_files([folder / "foreign.json", folder / "anna" / "mine.json"])
    assert download.value.path().read_text(encoding="utf-8").count("<th scope=row>") == 2
    expect_drops_checked(teacher)


def expect_drops_checked(teacher) -> None:
    """Files and folders are dropped on the page; what can't be checked is told."""
    page = teacher.page

    def drop(files) -> None:
        page.evaluate(DROP, {name: data if data is None else data.decode("latin-1") for name, data in files.items()})

    expect_report_of(teacher, lambda: drop(FROM_ELSEWHERE))
    problem = page.get_by_role("alert")
    drop({".hidden": b""})
    expect(problem).to_have_text([teacher.say("class.checkNothing")])
    drop({"gone.json": None})
    expect(problem).to_have_text([teacher.say("class.checkUnread", names="gone.json")])
    drop({str(number): b"" for number in range(1001)})
    expect(problem).to_have_text([teacher.say("class.checkTooMany", files="1,000")])
