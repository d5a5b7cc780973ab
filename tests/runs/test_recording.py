"""Recordings: they are read back as they were written, also where a run was cut off."""

import errno
import json
import shutil
import struct
import tracemalloc
from dataclasses import replace

import jsonschema_rs
import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from PIL import Image

from motorcade.engine.events import KINDS
from motorcade.errors import MotorcadeError
from motorcade.mats import Starts
from motorcade.mats.document import mat_of
from motorcade.runs import mcap_file
from motorcade.runs.recorder import Recorder, open_recording
from motorcade.runs.recording import Description, InMemoryRecording
from support.recorded_run import MAT, crowd, read_mcap, record, world, write_mcap

EXACT = ("word", "runs", "wheels", "led", "sends")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recordings")


@pytest.fixture(scope="module")
def kept(folder):
    """Three seconds in memory, and in ``run.mcap`` of ``folder``."""
    return record([folder / "run.mcap"], world(seeds=7))


def all_events(recording):
    return np.concatenate(list(recording.events()))


def assert_same_moments(found, expected):
    assert [moment.t_ms for moment in found] == [moment.t_ms for moment in expected]
    for one, other in zip(found, expected, strict=True):
        for name in ("x_m", "y_m", "heading"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-6)
        for name in EXACT:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert dict(one.counts) == dict(other.counts)


def test_a_recording_is_read_back(folder, kept):
    recording = open_recording(folder / "run.mcap")
    assert_same_moments(list(recording.moments()), list(kept.moments()))
    assert [moment.t_ms for moment in recording.moments()] == list(range(0, 3001, 100))
    assert recording.last_ms == 3000
    events, expected = all_events(recording), all_events(kept)
    assert len(events) > 100
    np.testing.assert_array_equal(events, expected)
    assert {"state", "frame", "heard", "lost"} <= {KINDS[kind] for kind in events["kind"]}
    assert recording.damage is None


def test_a_file_that_is_named_twice_is_written_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record(["run.mcap", tmp_path / "run.mcap"], world(seeds=7), duration_ms=1000)
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]
    assert open_recording(tmp_path / "run.mcap").last_ms == 1000


def test_the_run_is_described(folder, kept):
    about = open_recording(folder / "run.mcap").about
    assert about == kept.about
    assert about.mat == replace(MAT, starts=Starts.of([], []))
    assert (about.leaders, about.cars, about.seeds, about.every_ms) == ((0,), 6, (7,), 100)
    assert bytes.fromhex(about.images[0])[0] == 2


def test_people_are_on_their_paths():
    about = Description.of(world(), 100)
    assert about.people_at(0) == [(3.5, 0.5)]
    assert about.people_at(1000) == about.people_at(3000) == [(3.5, 1.5)]


def test_the_last_moment_is_recorded_with_any_slices(tmp_path):
    cars = world()
    with Recorder(tmp_path / "run.mcap", cars, every_ms=500) as recorder:
        for _ in range(7):
            cars.run(180)
            recorder(cars)
    assert [moment.t_ms for moment in open_recording(tmp_path / "run.mcap").moments()] == [0, 540, 1080, 1260]


def test_a_world_without_events_is_recorded_without_them(tmp_path):
    cars = world()
    with Recorder(tmp_path / "run.mcap", cars, events=False) as recorder:
        cars.run(500)
        recorder(cars)
    recording = open_recording(tmp_path / "run.mcap")
    assert sum(map(len, recording.events())) == 0
    assert list(recording.moments())[-1].counts["frames"] > 0


def test_each_of_several_worlds_is_recorded_with_its_number(tmp_path):
    cars, alone = world(seeds=[7, 8]), world(seeds=8)
    kept, expected = record([tmp_path / "two.mcap", tmp_path / "two.png"], cars, 500), record([], alone, 500)
    recording = open_recording(tmp_path / "two.mcap")
    assert recording.about.seeds == (7, 8)
    for found in (kept, recording):
        moments = list(found.moments())
        assert [(moment.t_ms, moment.world) for moment in moments[:4]] == [(0, 0), (0, 1), (100, 0), (100, 1)]
        assert_same_moments([moment for moment in moments if moment.world == 1], list(expected.moments()))
        events, of_one = all_events(found), all_events(expected)
        mine = events[events["world"] == 1]
        assert 0 < len(mine) < len(events)
        for name in ("t_ms", "car", "kind", "why", "word", "other"):
            np.testing.assert_array_equal(mine[name], of_one[name])


def test_a_run_after_a_reset_is_recorded_too(tmp_path):
    cars = world(seeds=7)
    first_ms, again_ms = range(0, 401, 100), range(0, 201, 100)
    with Recorder([tmp_path / "run.mcap", tmp_path / "run.png", tmp_path / "run.gif"], cars) as recorder:
        for _ in first_ms[1:]:
            cars.run(100)
            recorder(cars)
        cars.reset()
        recorder(cars)
        for _ in again_ms[1:]:
            cars.run(100)
            recorder(cars)
    recording = open_recording(tmp_path / "run.mcap")
    moments = [(moment.run, moment.t_ms) for moment in recording.moments()]
    assert moments == [*((0, t_ms) for t_ms in first_ms), *((1, t_ms) for t_ms in again_ms)]
    assert recording.last_ms == 600
    assert {*all_events(recording)["run"].tolist()} == {0, 1}
    # Players need times that rise.
    with (tmp_path / "run.mcap").open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)
    with Image.open(tmp_path / "run.gif") as film:
        assert film.n_frames == len(moments)


@pytest.mark.parametrize("every_ms", [0, -100, 0.5, float("nan")])
def test_an_interval_that_never_ends_is_refused(every_ms, tmp_path):
    with pytest.raises(MotorcadeError, match="every_ms is"):
        Recorder(tmp_path / "run.mcap", world(), every_ms=every_ms)


def test_a_run_in_slices_of_numpys_numbers_is_recorded(tmp_path):
    cars = world()
    with Recorder(tmp_path / "run.mcap", cars, every_ms=np.int64(100)) as recorder:
        for _ in range(3):
            cars.run(np.int64(100))
            recorder(cars)
    assert [moment.t_ms for moment in open_recording(tmp_path / "run.mcap").moments()] == [0, 100, 200, 300]


# while a run goes on


def test_a_run_that_is_not_complete_leaves_the_old_recording(tmp_path):
    record([tmp_path / "run.mcap"], world())
    old = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    cars = world()
    with Recorder(tmp_path / "run.mcap", cars) as recorder:
        cars.run(100)
        recorder(cars)
        # A process that is killed here leaves this.
        left = {name: (tmp_path / name).read_bytes() for name in old}
    assert left == old
    assert (tmp_path / "run.mcap").read_bytes() != old["run.mcap"]


def test_a_killed_process_leaves_a_readable_part(tmp_path):
    cars = world()
    (tmp_path / "killed").mkdir()
    with Recorder(tmp_path / "run.mcap", cars) as recorder:
        for _ in range(130):
            cars.run(100)
            recorder(cars)
        for file in tmp_path.glob("run.*"):
            shutil.copy(file, tmp_path / "killed")
    whole = list(open_recording(tmp_path / "run.mcap").moments())
    left = open_recording(tmp_path / "killed" / "run.mcap")
    moments = list(left.moments())
    assert 40 < len(moments) < len(whole)
    assert_same_moments(moments, whole[: len(moments)])
    assert left.last_ms == moments[-1].t_ms
    assert f"what came after {moments[-1].t_ms / 1000:g} s is missing" in str(left.damage)
    assert len(all_events(left)) > 100
    # A byte that is wrong is as good as an end.
    data = bytearray((tmp_path / "run.mcap").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (tmp_path / "run.mcap").write_bytes(data)
    damaged = open_recording(tmp_path / "run.mcap")
    moments = list(damaged.moments())
    assert_same_moments(moments, whole[: len(moments)])
    assert str(damaged.damage).startswith(f"{tmp_path / 'run.mcap'} is cut off or damaged")


def test_an_interrupted_run_leaves_a_complete_recording(tmp_path):
    cars = world()

    def interrupted():
        with Recorder(tmp_path / "run.mcap", cars) as recorder:
            cars.run(400)
            recorder(cars)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    recording = open_recording(tmp_path / "run.mcap")
    assert [moment.t_ms for moment in recording.moments()] == [0, 400]
    assert recording.damage is None
    assert not list(tmp_path.glob("*.part"))


def test_a_disk_that_is_full_ends_the_run_in_a_sentence(tmp_path, monkeypatch):
    def full(*given):
        raise OSError(errno.ENOSPC, "No space left on device")

    cars = world()
    refused = pytest.raises(MotorcadeError, match=r"run\.mcap can't be written: the disk is full")
    with refused, Recorder(tmp_path / "run.mcap", cars) as recorder:
        cars.run(100)
        monkeypatch.setattr(mcap_file.McapSink, "write", full)
        recorder(cars)


# files that are refused


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.mcap", b"GIF89a is another kind of file altogether", "is no MCAP file"),
        ("a.mcap", b"", "is cut off before the run begins"),
        ("a.png", b"\x89PNG", "is no recording: the name of a recording ends in .mcap"),
        ("gone/a.mcap", None, "can't be read: there is no such file or folder"),
    ],
)
def test_a_file_of_another_format_is_refused_in_a_sentence(name, content, sentence, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(MotorcadeError) as refused:
        open_recording(tmp_path / name)
    assert str(refused.value).startswith(str(tmp_path / name))
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("gone/run.mcap", "there is no folder"),
        ("gone/run.gif", "there is no folder"),
        ("folder.mcap", "it is a folder"),
        ("run.csv", "its name must end in .mcap, .gif, .png, .svg or .pdf"),
    ],
)
def test_a_run_does_not_begin_where_a_file_cannot_be_written(name, sentence, tmp_path):
    (tmp_path / "folder.mcap").mkdir()
    old = tmp_path / "run.mcap"
    old.write_bytes(b"old")
    with pytest.raises(MotorcadeError, match="can't be written") as refused:
        Recorder([old, tmp_path / name], world())
    assert sentence in str(refused.value)
    assert old.read_bytes() == b"old"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["folder.mcap", "run.mcap"]


# for other tools


def test_mcap_messages_fit_their_schemas_and_have_foxgloves_names(folder, kept):
    with (folder / "run.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        (metadata,) = reader.iter_metadata()
        mat = json.loads(metadata.metadata["mat"])
        assert (mat["name"], mat_of(mat, "it").walls) == (MAT.name, MAT.walls)
        validators, topics = {}, {}
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            check = validators.setdefault(schema.id, jsonschema_rs.validator_for(json.loads(schema.data)))
            content = json.loads(message.data)
            check.validate(content)
            assert message.log_time == content.get("t_ms", message.log_time // 1_000_000) * 1_000_000
            topics.setdefault(channel.topic, []).append((schema.name, content))
        chunks = reader.get_summary().chunk_indexes
    names = {topic: {name for name, _ in messages} for topic, messages in topics.items()}
    assert names["/scene"] == names["/mat"] == {"foxglove.SceneUpdate"}
    counts = {topic: len(messages) for topic, messages in topics.items() if topic != "/events"}
    assert counts == {"/mat": 1, "/scene": 31, "/cars": 31, "/counts": 31}
    assert {chunk.compression for chunk in chunks} == {"zstd"}


def test_the_scene_shows_each_car_where_it_is(folder, kept):
    with (folder / "run.mcap").open("rb") as file:
        messages = list(make_reader(file).iter_messages(topics=["/scene", "/mat"]))
    mat, scene = (json.loads(messages[place][2].data)["entities"] for place in (0, -1))
    *_, last = kept.moments()
    (cars,) = (entity for entity in scene if entity["id"] == "cars")
    points = [point for each in cars["triangles"] for point in each["points"]]
    tips = {(point["x"], point["y"]) for point in points[::3]}
    radius_m = 0.075
    ahead = last.x_m + radius_m * np.cos(last.heading), last.y_m + radius_m * np.sin(last.heading)
    np.testing.assert_allclose(sorted(tips), sorted(np.column_stack(ahead).tolist()), atol=1e-3)
    places = [(each["pose"]["position"]["x"], each["pose"]["position"]["y"]) for each in cars["texts"]]
    np.testing.assert_allclose(places, np.column_stack([last.x_m, last.y_m]), atol=1e-4)
    assert [each["text"] for each in cars["texts"]] == list("012345")
    entities = [json.loads(message.data)["entities"] for _, channel, message in messages if channel.topic == "/scene"]
    leds = [len(each["cylinders"]) for entity in entities for each in entity if each["id"] == "cars"]
    assert leds == [np.count_nonzero(moment.led < 4) for moment in kept.moments()]
    assert max(leds) > 0
    # The wall, the mat's four edges and the triangle's three sides.
    assert len(mat[0]["cubes"]) == 8


def test_many_cars_are_triangles_of_few_colours(tmp_path):
    many = crowd(2500, 4)
    *_, last = many.moments()
    sink = mcap_file.McapSink(tmp_path / "many.mcap", many.about)
    sink.write(last)
    sink.close()
    with (tmp_path / "many.mcap").open("rb") as file:
        ((_, _, scene),) = make_reader(file).iter_messages(topics=["/scene"])
    cars, _ = json.loads(scene.data)["entities"]
    assert not cars["texts"]
    assert sum(len(each["points"]) for each in cars["triangles"]) == 3 * 2500
    assert len(cars["triangles"]) == 2


@pytest.mark.parametrize("keeps", [True, False])
def test_films_and_pictures_are_drawn_at_the_end_of_the_run(keeps, tmp_path):
    cars, done = world(), []
    kept = InMemoryRecording(Description.of(cars, 100)) if keeps else None
    with Recorder([kept, tmp_path / "run.gif", tmp_path / "run.png"], cars, progress=done.append) as recorder:
        for _ in range(3):
            cars.run(100)
            recorder(cars)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.gif", "run.png"]
    assert done[-1] == 2 * 300
    with Image.open(tmp_path / "run.gif") as film:
        assert film.n_frames == 4


@pytest.mark.parametrize("compress", [lz4.frame.compress, zstandard.compress], ids=["lz4", "zstd"])
@pytest.mark.parametrize("said", [1 << 27, 100], ids=["says so", "says less"])
def test_a_small_file_that_would_become_gigabytes_is_read_in_little_memory(
    compress, said, folder, kept, tmp_path, monkeypatch
):
    monkeypatch.setattr(mcap_file, "MOST_CONTENT_BYTES", 1 << 20)
    content = compress(bytes(1 << 27))
    name = b"lz4" if compress is lz4.frame.compress else b"zstd"
    head = struct.pack("<QQQI", 0, 0, said, 0) + struct.pack("<I", len(name)) + name
    chunk = head + struct.pack("<Q", len(content)) + content
    data = (folder / "run.mcap").read_bytes()
    # Behind the magic and the first record, whose length follows its first byte.
    at = 17 + struct.unpack_from("<Q", data, 9)[0]
    (tmp_path / "run.mcap").write_bytes(data[:at] + b"\x06" + struct.pack("<Q", len(chunk)) + chunk + data[at:])
    tracemalloc.start()
    try:
        with pytest.raises(MotorcadeError):
            list(open_recording(tmp_path / "run.mcap").moments())
        assert tracemalloc.get_traced_memory()[1] < 1 << 25
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('"wheels"', '"whales"'),
        ('"wheels":[2,', '"wheels":['),
        ('"led":[0', '"led":[400'),
        ('"t_ms":200', '"t_ms":null'),
    ],
)
def test_a_message_that_somebody_has_made_ends_a_recording_as_a_cut_does(before, after, folder, kept, tmp_path):
    messages, about = read_mcap(folder / "run.mcap")
    cars = [at for at, (topic, _) in enumerate(messages) if topic == "/cars"]
    topic, text = messages[cars[2]]
    assert before in text
    messages[cars[2]] = topic, text.replace(before, after)
    write_mcap(tmp_path / "made.mcap", messages, about)
    recording = open_recording(tmp_path / "made.mcap")
    assert [moment.t_ms for moment in recording.moments()] == [0, 100]
    assert recording.damage.code == "recording-cut-off"


@pytest.mark.parametrize(
    ("name", "value"),
    [("cars", '"six"'), ("every_ms", "0"), ("leaders", "[6]"), ("images", '["00"]'), ("seeds", "[1.5]")],
)
def test_a_run_that_is_described_wrongly_is_refused(name, value, folder, kept, tmp_path):
    messages, about = read_mcap(folder / "run.mcap")
    write_mcap(tmp_path / "made.mcap", messages, about | {name: value})
    with pytest.raises(MotorcadeError):
        open_recording(tmp_path / "made.mcap")
