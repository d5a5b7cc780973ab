"""What comes from others, one program for each kind: whatever comes, the answer is a sentence or the thing itself.

Those of files that only commands open are in `tests.fuzz.files`.
"""

import asyncio
import hashlib
import io
import json
import struct
import tempfile
import zipfile
from base64 import b64decode
from binascii import crc32
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import msgspec
from hypothesis import strategies as st
from starlette.websockets import WebSocketDisconnect
from tests.fuzz import documents, files
from tests.fuzz.documents import damaged
from tests.fuzz.making import HARNESSES, harness, refused

from motorcade.car import brain, frames
from motorcade.car.senses import NOTHING
from motorcade.classroom.app import REQUESTS, class_view, pupil_view
from motorcade.classroom.pairs import Pairs
from motorcade.classroom.record import from_bytes, to_bytes
from motorcade.classroom.room import Classroom
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.drive.keys import RevokedKeys, read_revoked
from motorcade.engine.saving import MAGIC
from motorcade.engine.world import World
from motorcade.fleet.places import read_list, safe_name
from motorcade.lab.capsule import verify, write_capsule
from motorcade.lab.plan import Plan
from motorcade.lab.run import no_bar, run_sweep
from motorcade.lab.spec import parse_sweep
from motorcade.lab.task import run_task
from motorcade.mats.document import check_mat, document_of, mat_of, parse_mat
from motorcade.missions.document import OWN, parse_mission
from motorcade.program.decompiler import decompile
from motorcade.program.python_reader import read_python
from motorcade.program.python_writer import python_text, updated_text
from motorcade.runs.recorder import open_recording
from motorcade.server.fleet import SingleCar
from motorcade.server.page_socket import PageSocket
from motorcade.server.remote import NEWEST, PageSession
from motorcade.server.request_filter import ServerSettings
from motorcade.service.documents import open_file, open_text, project_text
from motorcade.service.messages import Blocks, decode
from motorcade.service.programs import compile_blocks
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import WorldMessage
from motorcade.service.world_session import WorldSession
from motorcade.upload.serial_port import port_name
from motorcade.words import upload
from motorcade.words.image import image_words, parse_image_bytes
from motorcade.words.infrared import FrameReceiver, check_is_good, frame_durations_us, parity_is_even, tag_of
from motorcade.words.packing import bytes_to_words, words_to_bytes
from motorcade.words.request import REQUEST_BEGINS, answer_line, car_request, check_request, read_request
from motorcade.words.ticks import later_ms
from support.classrooms import MAT as NO_MAT
from support.classrooms import with_pupils
from support.recorded_run import record, world
from support.socketless_car import SocketlessCar, ask, command, receive
from support.strategies import tagged_frames
from support.upload_ends import NO_PROGRAM, ReceivingCar, events_of, images

__all__ = ["HARNESSES", "files"]

PROFILE = built_in_profile("classroom")
LEVELS = levels_of(PROFILE)
BITS = st.integers(0, (1 << 32) - 1)


@harness(st.lists(st.tuples(tagged_frames() | BITS, st.integers(0, 40_000), st.integers(0, 1)), max_size=20))
def infrared_frames(heard):
    s, now = [0] * brain.SIZE, 0
    brain.switch_on(s, 1, now)
    for frame, wait_ms, is_busy in heard:
        now = later_ms(now, wait_ms)
        brain.follower_step(s, now, LEVELS)
        is_good = parity_is_even(frame) and (check_is_good(frame) if tag_of(frame) else frame & 0x7FE == 0)
        assert frames.follower_hears(s, frame, now, LEVELS) != frames.BEGUN or is_good
        frame = frames.follower_frame(s, is_busy, now, LEVELS)
        assert frame == frames.NO_FRAME or parity_is_even(frame)
        assert 0 <= brain.wheels(s, NOTHING, now, LEVELS) < 12
        assert all(0 <= each < 1 << 32 for each in s)


@harness(st.lists(st.tuples(BITS, st.integers(-70, 70), st.lists(st.integers(0, 20_000), max_size=3)), max_size=4))
def marks_and_spaces(sent):
    receiver = FrameReceiver()
    for frame, stretch_us, noise in sent:
        # A receiver makes all marks longer and all spaces shorter, or the other way round.
        exact = enumerate(frame_durations_us(frame))
        clean = [us + (stretch_us if place % 2 == 0 else -stretch_us) for place, us in exact]
        for place, us in enumerate((*noise, *([5000] if len(noise) % 2 else []), *clean, 40_000)):
            receiver.receive_mark(us) if place % 2 == 0 else receiver.receive_space(us)
        found = list(iter(receiver.next_frame, None))
        assert noise or found == [frame]


@harness(images() | st.binary(max_size=60), st.lists(st.tuples(st.integers(0, 100), st.integers(0, 255)), max_size=3))
def image_files(data, changes):
    content = bytearray(data)
    for at, byte in changes:
        content[at : at + 1] = bytes([byte])
    data, car = bytes(content), ReceivingCar()
    car.take(data, 0)
    car.take(b"", 600)
    is_image = False
    with refused():
        is_image = words_to_bytes(image_words(parse_image_bytes(data))) == data
        assert decompile(bytes_to_words(data)).as_json()
    assert is_image == (car.stored == data) or data == NO_PROGRAM


@cache
def _sendings() -> st.SearchStrategy[bytes]:
    made = st.builds(check_request, BITS, st.integers(0, 255)) | st.builds(
        car_request, st.sampled_from("abnsg?"), st.integers(0, 255), st.text("abc-_", max_size=32)
    )
    strange = st.binary(min_size=36, max_size=36).map(_with_sum)
    return st.one_of(images(), st.binary(max_size=12), made, strange, st.just(upload.READBACK_REQUEST))


def _with_sum(text: bytes) -> bytes:
    """A request of any text, whose checksum is right."""
    return REQUEST_BEGINS + text + bytes(64 + (crc32(text) >> shift & 15) for shift in range(28, -4, -4))


@harness(
    st.lists(st.tuples(_sendings(), st.integers(0, 60), st.sampled_from([0, 1, 499, 500, 9999, 10_000])), max_size=8),
    st.integers(12, 40),
    st.integers(1, 40),
)
def upload_receiver(sent, most_words, work_words):
    end, stored = upload.CarEnd(most_words, work_words), b""
    arrivals = [(part, wait_ms) for data, cut, wait_ms in sent for part in (data[:cut], data[cut:])]
    for event in events_of(end, [*arrivals, *[(b"", 600)] * 60, (b"", 10_000)], 0):
        assert event.answer == b"" or event.answer.isascii()
        if event.kind == upload.IMAGE:
            stored = event.image
            assert len(stored) <= 4 * most_words
            parse_image_bytes(stored)
        if event.kind == upload.REQUEST and (asked := read_request(event.image)):
            assert answer_line(asked, ()).startswith(b"OK car=")
    image = bytes.fromhex("02000000 65800000 6a800000")
    events = events_of(end, [(image, 0), *[(b"", 1)] * 4], 100_000)
    assert [event.image for event in events if event.kind == upload.IMAGE] == [image]


@harness(
    st.lists(
        st.tuples(
            st.integers(0, 2),
            st.one_of(st.builds(command, st.integers(0, 180), st.integers(0, 255)), st.binary(max_size=40)),
            damaged(documents.DRIVE_REQUESTS),
            st.sampled_from([0, 10, 100, 299, 301, 5001]),
        ),
        max_size=12,
    )
)
def drive_wire(sent):
    car = SocketlessCar()
    drivers = [car.commands(port)[0] for port in range(3)]
    channels = [car.telemetry(2000 + port)[0] for port in range(3)]
    for number, data, text, wait_ms in sent:
        car.now_ms += wait_ms
        receive(drivers[number], data)
        request = text.encode(errors="replace")
        if channels[number].line:
            channels[number].data_received(struct.pack(">I", len(request)) + request)
        car.control.beat()
        car.tell()
    channel, line = car.telemetry(3000, "192.168.1.9")
    assert ask(channel, line, do="stop")["ok"]
    assert car.control.telemetry()[:4] == ("stopped", 90, 1, 0)


@harness(st.lists(st.tuples(damaged(documents.WORLD_MESSAGES), st.integers(0, 600)), max_size=6))
def studio_messages(sent):
    session = WorldSession("0" * 32, lambda message: open_world(message, 30), (1 << 20, 1 << 18))
    now_s, answers = 0.0, session.connect()
    answers += session.receive(decode(documents.WORLD_MESSAGES[1], WorldMessage))
    for text, wait_ms in sent:
        with refused():
            answers += session.receive(decode(text.encode(errors="replace"), WorldMessage))
        now_s += wait_ms / 1000
        answers += session.advance(now_s)
    for answer in answers:
        assert isinstance(answer, bytes) or msgspec.json.encode(answer)
    assert session.state().t_ms >= 0


_ASKED = sorted(name for name, (kind, _) in REQUESTS.items() if kind in (Classroom, Pairs))


@harness(
    st.lists(
        st.tuples(
            st.sampled_from(_ASKED), damaged(documents.CLASS_MESSAGES), st.sampled_from(["01", "02", "03", "09"])
        ),
        max_size=8,
    )
)
def class_messages(sent):
    room = with_pupils("Mia", "Ben", "小明", cars=["red"])
    pairs, now_s = Pairs(room), 0.0
    pairs.begin("01", "02", pairs.add("Ours"))
    for name, text, who in sent:
        now_s += 1.0
        kind, exchange = REQUESTS[name]
        given_ = {"self": room if kind is Classroom else pairs, "asks": None, "client": "a", "who": who, "now_s": now_s}
        with refused():
            arguments = exchange.request.arguments(text.encode(errors="replace"))
            exchange.request.function(**{each: given_[each] for each in exchange.request.given}, **arguments)
        assert from_bytes(to_bytes(room.record), "class.json") == room.record
        msgspec.json.encode(class_view(room, NO_MAT, now_s))
        for pupil in room.record.pupils:
            msgspec.json.encode(pupil_view(room, pupil, NO_MAT, pairs.view(pupil.id, now_s)))


class _Page:
    """The WebSocket of a page that sends texts and leaves; the server's other tasks run between them."""

    client, query_params = ("192.168.1.7", 5000), {"name": "Mia"}

    def __init__(self, texts: list[str], sent: list[bytes | str]) -> None:
        self._texts = iter(texts)
        self.send_text = self.send_bytes = self._send
        self._sent = sent

    async def _send(self, data: bytes | str) -> None:
        self._sent.append(data)

    async def receive(self) -> dict[str, Any]:
        for _ in range(4):
            await asyncio.sleep(0)
        text = next(self._texts, None)
        return {"type": "websocket.disconnect"} if text is None else {"type": "websocket.receive", "text": text}

    async def close(self, code: int) -> None:
        raise WebSocketDisconnect(code)


@harness(st.lists(damaged(documents.REMOTE_MESSAGES), max_size=12))
def remote_messages(texts):
    car, sent = SocketlessCar(), []
    page = _Page([documents.REMOTE_MESSAGES[0], *(text.encode(errors="replace").decode() for text in texts)], sent)
    clock = ServerSettings(clock=lambda: car.now_ms / 1000)
    asyncio.run(PageSession(page, PageSocket(page, clock, NEWEST), SingleCar(car.control), clock).serve())
    assert all(json.loads(each)["is"] in ("hello", "telemetry", "received", "error") for each in sent)
    # Who has left moves nothing, whatever was sent.
    assert car.control.telemetry().speed == 0
    assert car.control.telemetry().driver is None


@cache
def _saved() -> bytes:
    """A world that was saved, behind what begins its bytes."""
    told = world(seeds=7)
    told.run(300)
    return told.save()


@harness(
    st.lists(st.tuples(st.integers(0, 1 << 14), st.binary(max_size=8)), max_size=4),
    st.integers(0, 1 << 14),
    st.booleans(),
)
def saved_worlds(changes, cut, is_sealed):
    data = _saved()
    begin = len(MAGIC) + 32 if is_sealed else 0
    content = bytearray(data[begin:])
    for at, replaced in changes:
        at %= len(content)
        content[at : at + len(replaced)] = replaced
    if cut < len(content):
        del content[cut:]
    if is_sealed:
        # Somebody who changes it on purpose gives it the digest that belongs to it.
        content[:0] = MAGIC + hashlib.sha256(content).digest()
    with refused():
        loaded = World.load(bytes(content), threads=1)
        loaded.run(100)
        loaded.snapshot()
        loaded.take_events()
        assert World.load(loaded.save()).save() == loaded.save()


@harness(damaged(documents.projects()))
def project_files(text):
    with refused():
        project = open_file(text)
        stored = project_text(project)
        assert open_text(stored) == project
        compile_blocks(Blocks(project.leader, project.followers, project.profile))


@harness(damaged(documents.python_texts()))
def python_programs(text):
    with refused():
        read = read_python(text)
        # By value: 2.0 seconds are written as 2, and -0.0 as 0.
        document = json.loads(read.program.as_json())
        for text in (python_text(read.program), updated_text(read, read.program)):
            assert json.loads(read_python(text).program.as_json()) == document


@harness(damaged(documents.toml_files("examples/mats")))
def mat_files(text):
    with refused():
        mat = parse_mat(text, "mat.toml", "TOML")
        check_mat(mat, PROFILE)
        assert document_of(mat_of(document_of(mat), "again")) == document_of(mat)


@harness(damaged(documents.toml_files("src/motorcade/missions/gallery")))
def mission_files(text):
    with refused():
        assert parse_mission(text, OWN, "TOML").goals


@cache
def _recording() -> tuple[tempfile.TemporaryDirectory[str], Path, bytes]:
    """A folder, which is removed at the end, a short recording in it, and its bytes."""
    folder = tempfile.TemporaryDirectory(prefix="motorcade-")
    path = Path(folder.name) / "run.mcap"
    record([path], world(seeds=7), 300)
    return folder, path, path.read_bytes()


@harness(st.integers(0, 1 << 32), st.lists(st.tuples(st.integers(0, 1 << 14), st.binary(max_size=8)), max_size=4))
def recordings(seed, changes):
    _, path, data = _recording()
    content, random = bytearray(data), Random(seed)
    for at, replaced in changes:
        at %= len(content)
        content[at : at + len(replaced)] = replaced
    path.write_bytes(content[: random.randrange(len(content))] if seed % 4 == 0 else content)
    with refused():
        opened = open_recording(path)
        assert opened.last_ms >= 0
        assert len([*opened.moments(), *opened.events()]) >= 0
        msgspec.json.encode(opened.about.to_dict())


_SWEEP = """
format = "motorcade-sweep/1"
programs = ["a.image"]
mats = ["hall.toml"]
seconds = 1
seeds = 2
"""
_NEW = st.binary(max_size=40) | st.sampled_from([b"null", b"[]", b"{}", b"[" * 500, b"1e999", b"-1", b"9" * 5000])


@cache
def _capsule() -> tuple[tempfile.TemporaryDirectory[str], Path, dict[str, bytes]]:
    """A folder, which is removed at the end, a place for a capsule in it, and the members of a short one."""
    folder = tempfile.TemporaryDirectory(prefix="motorcade-")
    path, table = Path(folder.name) / "run.zip", Path(folder.name) / "a.parquet"
    mat = mat_of(documents.MAT, "hall.toml")
    plan = Plan(parse_sweep(_SWEEP, "sweep.toml"), [(image_of_words(), PROFILE)], [mat], "0", with_digests=True)
    run_sweep(plan, table, lambda plan, tasks: ((index, run_task(plan.task(index))) for index in tasks))
    write_capsule(path, _SWEEP.encode(), plan, table)
    with zipfile.ZipFile(path) as archive:
        return folder, path, {name: archive.read(name) for name in archive.namelist()}


def image_of_words() -> bytes:
    return b64decode(documents.IMAGE)


@harness(
    st.integers(0, 7), st.lists(st.tuples(st.integers(0, 1 << 14), _NEW, st.integers(0, 9)), max_size=3), st.booleans()
)
def capsules(which, changes, is_of_archive):
    """Changes of a member, or of the archive around them; the seal fits. Nothing is run."""
    _, path, members = _capsule()
    names = list(members)
    changed_members = dict(members)
    name = names[which % len(names)]

    def changed(data: bytes) -> bytes:
        content = bytearray(data)
        for at, new, count in changes:
            at %= len(content) + 1
            content[at : at + count] = new
        return bytes(content)

    if not is_of_archive:
        changed_members[name] = changed(members[name])
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as archive:
        for each, data in changed_members.items():
            archive.writestr(zipfile.ZipInfo(each), data)
        archive.comment = bytes(64)
    data = written.getvalue()[:-64]
    data = changed(data) if is_of_archive else data
    path.write_bytes(data + hashlib.sha256(data).hexdigest().encode())
    with refused():
        runs, difference = verify(path, None, lambda plan, tasks: (row for row in ()), no_bar)
        assert (runs, difference) == (0, None)


@harness(st.lists(damaged(documents.CAR_LISTS), max_size=2).map("".join))
def car_lists(text):
    """Each place is a car, a drive server or a port, of which only sockets and what may be a device are opened."""
    with tempfile.TemporaryDirectory(prefix="motorcade-") as folder:
        file = Path(folder) / "cars.toml"
        file.write_bytes(text.encode(errors="surrogatepass"))
        with refused():
            for place in read_list(file):
                assert place.kind in ("car", "drive")
                assert place.name == safe_name(place.name)
                if not place.host:
                    with refused():
                        assert "://" not in port_name(place.address).removeprefix("socket://")


@harness(st.lists(damaged(documents.REVOKED), max_size=2).map("".join))
def revoked_lists(text):
    """A list without its last line, or with another one, lets nobody in."""
    with tempfile.TemporaryDirectory(prefix="motorcade-") as folder:
        file = Path(folder) / "revoked.txt"
        file.write_bytes(text.encode(errors="surrogatepass"))
        numbers = None
        with refused():
            numbers = read_revoked(file)
        keys = RevokedKeys(file)
        assert (0x4A3F in keys) == (numbers is None or 0x4A3F in numbers)
        if numbers is not None:
            assert text.splitlines()[-1].startswith("# The end")
