"""A short run on a mat with obstacles and people, for the tests of recordings."""

from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer

from motorcade.engine.moment import COLUMNS, Moment
from motorcade.engine.world import World
from motorcade.mats import Mat, Person, Physics, Pose, Starts, formation
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.program.steps import forward, led, left, together
from motorcade.runs.recorder import Recorder
from motorcade.runs.recording import Description, InMemoryRecording

IMAGE = compile_program(
    Program([together(forward(2), led(0, 1)), left(2, speed=1)], [together(forward(2), led(1, 1)), left(2, speed=1)])
).image
POSES = [Pose(1 + pose.x, 1.5 + pose.y) for pose in formation(5)]
MAT = Mat(
    "a table with a wall",
    Starts.of(POSES, [number == 0 for number in range(len(POSES))]),
    tick_ms=20,
    size_m=(4.0, 3.0),
    walled=True,
    walls=((3.0, 0.5, 3.0, 2.5),),
    discs=((2.0, 0.4, 0.2),),
    polygons=(((0.2, 2.4), (0.6, 2.4), (0.4, 2.8)),),
    people=(Person(((0.0, 3.5, 0.5), (2.0, 3.5, 2.5)), repeats=True),),
    physics=Physics(bit_error_rate=0.01),
)


def world(**more):
    """A world on the mat, which one thread steps."""
    return World(MAT, [IMAGE], events=True, threads=1, **more)


def record(targets, cars, duration_ms=3000, every_ms=100):
    """Run ``cars``, record them into ``targets`` and in memory, and return the recording in memory."""
    recording = InMemoryRecording(Description.of(cars, every_ms))
    end_ms = cars.now_ms + duration_ms
    with Recorder([recording, *targets], cars, every_ms) as recorder:
        while cars.now_ms < end_ms:
            cars.run(every_ms)
            recorder(cars)
    return recording


def crowd(cars, moments):
    """A made-up recording of many cars in a square, in which a word spreads from the middle."""
    side = int(cars**0.5)
    places = np.arange(side) * 0.3
    xs, ys = (each.ravel() for each in np.meshgrid(places, places))
    leads = np.arange(len(xs)) == len(xs) // 2
    mat = Mat("a crowd", Starts(xs, ys, np.zeros_like(xs), leads), tick_ms=20)
    recording = InMemoryRecording(Description.of(World(mat, [IMAGE]), 100))
    word = int.from_bytes(IMAGE[-8:-4], "big")
    away_m = np.hypot(xs - xs[leads], ys - ys[leads])
    for moment in range(moments):
        held = away_m <= moment / moments * away_m.max()
        columns: dict[str, Any] = {name: np.zeros(len(xs), each.packed) for name, each in COLUMNS.items()}
        shown = Moment(t_ms=moment * 100, counts={"frames": moment, "heard": int(held.sum()) * moment}, **columns)
        shown = shown._replace(x_m=(xs + moment * 0.02).astype(np.float32), y_m=ys.astype(np.float32), runs=held)
        word_now = np.where(held, word, 0).astype(np.uint32)
        shown = shown._replace(word=word_now, led=np.full(len(xs), 4, np.uint8), sends=leads)
        recording.write(shown)
    return recording


def read_mcap(path):
    """The messages of a recording as topics and texts, and what it says of itself."""
    with path.open("rb") as file:
        reader = make_reader(file)
        messages = [(channel.topic, message.data.decode()) for _, channel, message in reader.iter_messages()]
        return messages, next(iter(reader.iter_metadata())).metadata


def write_mcap(path, messages, about):
    """Write a whole file whose messages may be anything."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("motorcade", about)
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channels = {topic: writer.register_channel(topic, "json", schema) for topic, _ in messages}
        for number, (topic, text) in enumerate(messages):
            at_ns = number * 10_000_000
            writer.add_message(channels[topic], at_ns, text.encode(errors="surrogatepass"), at_ns)
        writer.finish()
