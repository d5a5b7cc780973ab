"""Files that others may have made, and that a command or a car opens: what is damaged is refused in a sentence."""

import csv
import io
import json
import shutil
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from hypothesis import strategies as st
from tests.fuzz import documents
from tests.fuzz.documents import damaged
from tests.fuzz.making import harness, refused

from motorcade import Program, compile_program, forward, led
from motorcade.boards.computer import BatteryFile, ImageStore, sealed
from motorcade.classroom.record import from_bytes, to_bytes
from motorcade.classroom.room import Classroom
from motorcade.config.pins import parse_pins, parse_voice_map
from motorcade.config.profile import parse_profile
from motorcade.drive.certificates import AUTHORITY, ISSUED, CarKeys, list_keys, make_keys
from motorcade.drive.keys import client_context, name_in, server_context, with_end
from motorcade.engine.world import World
from motorcade.lab.search import Search, do_task, opened_archive
from motorcade.lab.spec import parse_sweep
from motorcade.mats.document import mat_of
from motorcade.missions.document import built_in_mission
from motorcade.missions.report import checked_file, files_of, to_csv, to_html
from motorcade.runs.recorder import open_recording
from motorcade.runs.recording import events_as_dicts
from motorcade.server.studio.library import FolderStorage
from motorcade.service.documents import EXAMPLES, example, project_text
from motorcade.service.library import MOST_BYTES, export_all, import_all
from motorcade.words.image import parse_image_bytes
from support.classrooms import with_pupils
from support.recorded_run import read_mcap, record, world, write_mcap

_DRIVES = Program([forward(2), led(1, 1)])
_TWO_CARS = mat_of(documents.MAT, "table")


@contextmanager
def new_folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="motorcade-") as name:
        yield Path(name)


def written(text: str) -> bytes:
    """A text as bytes, also where it is none that UTF-8 has."""
    return text.encode(errors="surrogatepass")


@harness(damaged(documents.toml_files("src/motorcade/profiles")))
def profiles(text):
    """A profile that is taken is one by which programs are compiled and cars drive."""
    with refused():
        profile = parse_profile(text, "own.toml")
        image = compile_program(_DRIVES, profile).image
        world = World(_TWO_CARS, [image], profile, seeds=[1], threads=1)
        world.run(60)
        world.snapshot()


@harness(damaged(documents.toml_files("firmware/linux", "firmware/micropython", "firmware/arduino")))
def pin_files(text):
    with refused():
        pins = parse_pins(text, "pins.toml")
        assert pins.chip


@harness(damaged((documents.toml_files("firmware/linux")[-1],)))
def voice_maps(text):
    with refused():
        found = parse_voice_map(text, "voice.toml")
        assert all(pattern for pattern, _ in found.patterns)


@harness(damaged(documents.toml_files("examples/sweeps", "examples/lab")))
def sweep_files(text):
    with refused():
        sweep = parse_sweep(text, "sweep.toml", lambda program: True)
        assert sweep.runs > 0
        assert sweep.duration_ms > 0


@harness(
    st.sampled_from((sealed(compile_program(_DRIVES).image), sealed(b"ada"), b"")),
    st.lists(st.tuples(st.integers(0, 200), st.binary(max_size=6)), max_size=3),
    st.booleans(),
)
def image_stores(data, changes, is_sealed):
    """A car runs what was stored whole, and calls itself what a car may be called."""
    content = bytearray(data[:-4] if is_sealed else data)
    for at, replaced in changes:
        content[at : at + len(replaced)] = replaced
    stored = sealed(bytes(content)) if is_sealed else bytes(content)
    with new_folder() as folder:
        (folder / "car.image").write_bytes(stored)
        (folder / "car.image.name").write_bytes(stored)
        store = ImageStore(folder / "car.image")
        with refused():
            image = store.load()
            assert image is not None
            parse_image_bytes(image)
        assert store.load_name().isascii()
        (folder / "battery").write_bytes(stored)
        with refused():
            assert 0 <= BatteryFile(folder / "battery").read_mv() < 10**9


@cache
def _records() -> tuple[str, ...]:
    room = with_pupils("Mia", "Ben", "小明", cars=["red"])
    return (to_bytes(room.record).decode(),)


@harness(damaged(_records()))
def class_files(text):
    """A class's file that is taken gives a class that can be shown and stored."""
    with refused():
        record = from_bytes(written(text), "class.json")
        room = Classroom(record, lambda below: 0, ["red"], 0.0)
        assert from_bytes(to_bytes(room.record), "class.json") == room.record


@cache
def _exports() -> tuple[str, ...]:
    with new_folder() as folder:
        storage = FolderStorage(folder)
        for name in list(EXAMPLES)[:2]:
            text = project_text(example(name)).encode()
            storage.write_version("", name, text, saved_at_s=1_700_000_000.0)
        storage.add_stars("", "forward-and-stop", [1])
        return (export_all(storage, "").text,)


@harness(damaged(_exports()))
def exported_projects(text):
    """What a file of all projects brings is stored, and comes out again; it writes nowhere else."""
    with new_folder() as folder:
        storage = FolderStorage(folder / "library")
        with refused():
            import_all(storage, "", text.encode(errors="replace").decode())
        known = {entry.name for entry in storage.list("")}
        again = json.loads(export_all(storage, "").text)
        assert {project["name"] for project in again["projects"]} == known
        assert [path.name for path in folder.iterdir()] in ([], ["library"])


_SEARCH_RUNS = 8


@cache
def _archive() -> list[Any]:
    """The lines of a short search's archive."""
    with new_folder() as folder:
        search = _search()
        with opened_archive(folder, search.contents) as archive:
            search.run(archive, _workers)
        lines = (folder / "archive.jsonl").read_text(encoding="utf-8").splitlines()
        return [line.partition(" ")[2] for line in lines]


def _search() -> Search:
    return Search(built_in_mission("forward-and-stop"), "map-elites", _SEARCH_RUNS, ahead=1)


def _workers(search: Search, numbers: Iterator[int | None]) -> Iterator[tuple[int, bytes]]:
    """Workers of which only the first ones work; they are asked for a result each time."""
    for number in numbers:
        if number is None:
            return
        yield number, do_task(search.task(number))


def _idle(search: Search, numbers: Iterator[int | None]) -> Iterator[tuple[int, bytes]]:
    yield from ()


@harness(st.integers(0, 9), st.randoms(use_true_random=False), st.booleans(), st.data())
def search_archives(which, random, is_sealed, data):
    """An archive is continued where it is whole, and about these programs; its grades are grades."""
    lines = list(_archive())
    at = which % len(lines)
    lines[at] = data.draw(damaged((lines[at],)))
    with new_folder() as folder:
        search = _search()
        texts = [written(line) for line in lines]
        sums = [zlib.crc32(text) if is_sealed else random.getrandbits(32) for text in texts]
        archive = b"".join(b"%08x %s\n" % pair for pair in zip(sums, texts, strict=True))
        (folder / "archive.jsonl").write_bytes(archive)
        with refused():
            with opened_archive(folder, search.contents) as opened:
                search.run(opened, _idle)
            assert all(0 <= candidate.mean.grade <= 1 for candidate in search.best.ranked())
            search.save_best(folder)


@cache
def _keys() -> tuple[tempfile.TemporaryDirectory[str], Path]:
    """A folder with keys, which is removed at the end."""
    folder = tempfile.TemporaryDirectory(prefix="motorcade-")
    path = Path(folder.name)
    make_keys(path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    return folder, path


@harness(
    st.sampled_from(("car-ada.pem", "driver-lin.pem", AUTHORITY, ISSUED)),
    st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 40), st.text(max_size=3) | st.just("-----")), max_size=3),
    st.booleans(),
)
def keys_files(name, changes, has_end):
    """A keys file is one, or nobody drives with it."""
    _, made = _keys()
    with new_folder() as folder:
        shutil.copytree(made, folder / "keys")
        file = folder / "keys" / name
        text = file.read_text(encoding="utf-8")
        for at, count, new in changes:
            at %= len(text) + 1
            text = text[:at] + new + text[at + count :]
        if name == ISSUED and has_end:
            text = with_end("".join(f"{line}\n" for line in text.splitlines() if not line.startswith("# The end")))
        file.write_bytes(written(text))
        for use in (server_context, client_context, name_in):
            with refused():
                use(file)
        with refused():
            assert list_keys(folder / "keys")


@cache
def _work() -> list[bytes]:
    projects = [text.encode() for text in documents.projects()[:2]]
    python = [text.encode() for text in documents.python_texts()[:2]]
    return [*projects, *python, compile_program(_DRIVES).image, b"\x89PNG\r\n", b"PK\x03\x04"]


_NAMES = st.text(st.sampled_from("ab/ .=+-@;\t\n\"'<>&\u202e\u8f66"), min_size=1, max_size=12)


@harness(
    _NAMES,
    st.integers(0, 6),
    st.sampled_from((".py", ".motorcade.json", ".image", ".txt", "")),
    st.lists(st.tuples(st.integers(0, 3000), st.binary(max_size=4)), max_size=3),
)
def reports(name, which, ending, changes):
    """A report on files that pupils handed in: no file ends it, no name is a formula or changes its page."""
    mission = built_in_mission("forward-and-stop")
    content = bytearray(_work()[which])
    for at, replaced in changes:
        at %= len(content) + 1
        content[at : at + len(replaced)] = replaced
    with new_folder() as folder:
        parts = [part for part in name.split("/") if part.strip(".")]
        file = folder.joinpath(*parts[:-1], (parts or ["x"])[-1] + ending)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        checked = [checked_file(mission, folder, path) for path in files_of(folder)]
        for language in ("en", "zh"):
            table = to_csv(checked, mission, language)
            cells = [cell for row in list(csv.reader(io.StringIO(table)))[1:] for cell in row]
            assert not [cell for cell in cells if cell.lstrip()[:1] in ("=", "@", "+")]
            page = to_html(checked, mission, language)
            plain = to_html([entry._replace(name="x") for entry in checked], mission, language)
            assert [page.count(sign) for sign in "<>"] == [plain.count(sign) for sign in "<>"]


@cache
def _recorded() -> tuple[list[tuple[str, str]], dict[str, str]]:
    """The messages of a short recording by their topics, and what it says of itself."""
    with new_folder() as folder:
        record([folder / "run.mcap"], world(seeds=7), 200)
        return read_mcap(folder / "run.mcap")


@harness(st.data(), st.booleans())
def made_recordings(data, is_message):
    """A recording that somebody has made: its file is whole, and what it holds may be anything."""
    messages, about = _recorded()
    messages, about = list(messages), dict(about)
    if is_message:
        at = data.draw(st.integers(0, len(messages) - 1))
        topic, text = messages[at]
        messages[at] = topic, data.draw(damaged((text,)))
    else:
        key = data.draw(st.sampled_from(sorted(about)))
        about[key] = data.draw(damaged((about[key],))).encode(errors="replace").decode()
    with new_folder() as folder:
        path = folder / "run.mcap"
        write_mcap(path, messages, about)
        with refused():
            opened = open_recording(path)
            assert json.dumps([moment.to_dict() for moment in opened.moments()])
            assert json.dumps([events_as_dicts(batch) for batch in opened.events()])
            assert opened.last_ms >= 0
            json.dumps(opened.about.to_dict())


@harness(st.integers(0, 1 << 16), st.sampled_from((b"", b"\0", b"{", b"\xff\xfe", b"[" * 3000)), st.booleans())
def libraries(seed, damage, is_replaced):
    """A library whose files somebody has damaged is shown, and what is whole can be read."""
    random = Random(seed)
    with new_folder() as folder:
        storage = FolderStorage(folder)
        for name in list(EXAMPLES)[:2]:
            storage.write_version("", name, project_text(example(name)).encode())
        storage.add_stars("", "forward-and-stop", [1])
        file = random.choice([path for path in sorted(folder.rglob("*")) if path.is_file() and path.stat().st_size])
        data = file.read_bytes()
        at = random.randrange(len(data))
        file.write_bytes(damage if is_replaced else data[:at] + damage)
        fresh = FolderStorage(folder)
        for entry in fresh.list(""):
            with refused():
                assert len(fresh.read("", entry.name)) <= MOST_BYTES
        fresh.stars("")
        assert json.loads(export_all(fresh, "").text)
