"""All backends give the same bits, with any number of threads; a library that can't be used is told, and not used."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Pose
from motorcade.browser.kernels import BrowserKernels
from motorcade.engine import agents
from motorcade.engine.backend import NAMES, Backend
from motorcade.engine.native import InterpretedKernels, NativeKernels, Wavefront, library_path
from motorcade.engine.simulation import Simulation
from motorcade.engine.webassembly import WebAssemblyKernels
from motorcade.engine.world import DIGESTS, library_problem, proof
from motorcade.errors import MotorcadeError
from support.linear_instance import MockInstance
from support.waiting import DEADLINE_S
from support.world_hash import state_hash
from support.worlds import ROAMING, Case, CrowdedWorld, cases, contents, crowd, digest, large_and_many, ran

FEW = settings(max_examples=max(settings().max_examples // 5, 1))
SLICE_MS = 200


@FEW
@given(cases(tick_ms=20), cases(tick_ms=20), st.data())
def test_every_backend_gives_the_same_bits(case: Case, other: Case, data: st.DataObject) -> None:
    """Worlds in which cars drive, are driven, moved and given back, get words, walls change, and all begins again."""
    given_all = case.mat, case.images, case.profile
    worlds: list[Simulation] = [CrowdedWorld(*given_all, seeds=case.seed, events=True, kernels=name) for name in NAMES]
    # As a browser has it, where there is no NumPy; wasmtime stands for the browser.
    worlds.append(Simulation(*given_all, BrowserKernels(MockInstance()), seeds=(case.seed,), events=True))
    cars = st.integers(0, worlds[0].cars - 1)
    for number in range(6):
        moved, driven, angle = data.draw(cars), data.draw(cars), data.draw(st.integers(0, 180))
        words = data.draw(given_words(worlds[0].cars))
        pose = Pose(float(other.mat.starts.x_m[number]), float(other.mat.starts.y_m[number]), 0.3 * number)
        for world in worlds:
            if number == 2:
                world.set_environment(other.mat, other.profile.infrared.range_mm)
            if number == 4:
                world.reset(case.seed + 1)
            world.move(moved, pose)
            world.drive(driven, angle, number % 2, 200)
            if number % 3 == 2:
                world.give_back(driven)
            if number == 3:
                world.say("stop")
            if world.tick:
                world.begin_words(words)
            world.run(SLICE_MS)
        sensed = [(world.backend.read(world.read_senses()), world.look_ahead(driven, 1000)) for world in worlds]
        assert sensed == sensed[:1] * 4, number
        hashes = [state_hash(world) for world in worlds]
        assert hashes == hashes[:1] * 4, number


def given_words(cars: int) -> st.SearchStrategy[bytes]:
    """Words for the cars of a world, or none for some of them."""
    word = st.just(agents.KEEP) | st.integers(0, (1 << 21) - 1).map(lambda bits: bits << 11)
    return st.lists(word, min_size=cars, max_size=cars).map(lambda words: np.array(words, "<u4").tobytes())


@FEW
@given(cases(tick_ms=20), st.data())
def test_cars_that_get_words_do_the_same_where_every_car_looks_around_then(case: Case, data: st.DataObject) -> None:
    worlds = [CrowdedWorld(case.mat, case.images, case.profile, seeds=case.seed, events=True) for _ in range(2)]
    for world in worlds:
        world.step()
    for _ in range(4):
        words = data.draw(given_words(worlds[0].cars))
        for number, world in enumerate(worlds):
            world.begin_words(words)
            if number:
                world.set_environment(case.mat)
            world.run(SLICE_MS)
        one, other = ({name: value.tolist() for name, value in contents(world).items()} for world in worlds)
        # When it looks again.
        one.pop("due"), other.pop("due")
        assert one == other
        assert worlds[0].take_events().tolist() == worlds[1].take_events().tolist()


def test_any_number_of_threads_gives_the_same_bits_also_of_threads_of_python() -> None:
    """One thread steps a large world as a whole, several threads step it in strips; or a share of many worlds each."""
    expected = large_and_many(1, "webassembly")
    assert len(set(expected)) == 6
    assert large_and_many(8, "native") == expected
    # Worlds of several threads of Python don't disturb each other.
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(lambda threads: large_and_many(threads, "native"), (2, 3))) == [expected] * 2


def all_end(wavefront: Wavefront, threads: int) -> bool:
    """Whether several threads that work at a wavefront end, of which one may be interrupted."""

    def work() -> None:
        with suppress(KeyboardInterrupt):
            wavefront.work()

    working = [Thread(target=work, daemon=True) for _ in range(threads)]
    for each in working:
        each.start()
    for each in working:
        each.join(timeout=10)
    return not any(each.is_alive() for each in working)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("strips", [1, 2, 7])
def test_a_strip_takes_a_step_when_its_neighbours_have_taken_the_one_before(strips: int, threads: int) -> None:
    taken, early = [0] * strips, list[tuple[int, int]]()

    def take(strip: int, step: int) -> None:
        neighbours = taken[max(strip - 1, 0) : strip + 2]
        if taken[strip] != step or not all(step <= each <= step + 1 for each in neighbours):
            early.append((strip, step))
        taken[strip] += 1

    assert all_end(Wavefront(take, strips, 48, 3, lambda: False), threads)
    assert (taken, early) == ([48] * strips, [])


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("strips", [1, 2, 7])
def test_strips_that_are_stopped_have_taken_as_many_steps_each(strips: int, threads: int) -> None:
    """A step may change what the others read, so all end with the tick that one of them has begun."""
    for stopped_at in range(48):
        taken, stop = [0] * strips, Event()

        def take(strip: int, step: int, taken: list[int] = taken, at: int = stopped_at, stop: Event = stop) -> None:
            taken[strip] += 1
            if step == at:
                stop.set()

        wavefront = Wavefront(take, strips, 48, 3, stop.is_set)
        assert all_end(wavefront, threads)
        assert taken == [wavefront.steps] * strips
        assert wavefront.steps % 3 == 0
        assert stopped_at < wavefront.steps <= min(stopped_at + 3 + strips, 48)


def test_when_one_thread_is_interrupted_the_others_end() -> None:
    interrupts = iter([KeyboardInterrupt()])

    def take(strip: int, step: int) -> None:
        if step == 3:
            for each in interrupts:
                raise each

    assert all_end(Wavefront(take, 4, 48, 3, lambda: False), 3)


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The file that is taken for the library of this computer: a copy."""
    copy = tmp_path / library_path().name
    for file in (library_path(), library_path().with_name(DIGESTS)):
        shutil.copy(file, tmp_path)
    monkeypatch.setattr("motorcade.engine.world.library_path", lambda: copy)
    monkeypatch.setattr("motorcade.engine.native.library_path", lambda: copy)
    library_problem.cache_clear()
    yield copy
    library_problem.cache_clear()


FOREIGN = b"of another system"


def change(library: Path, contents: bytes, **digests: str) -> None:
    """Write other contents and digests; the default of both is what is there."""
    path = library.with_name(DIGESTS)
    path.write_text(json.dumps(json.loads(path.read_text()) | digests))
    library.write_bytes(contents or library.read_bytes())


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (Path.unlink, "library-missing"),
        (lambda library: change(library, library.read_bytes()[:5000]), "library-damaged"),
        (lambda library: change(library, FOREIGN, **{library.name: sha256(FOREIGN).hexdigest()}), "library-not-loaded"),
        (lambda library: change(library, b"", proof="0" * 64), "library-differs"),
    ],
)
def test_without_a_good_library_webassembly_runs(library: Path, spoil: Callable[[Path], None], code: str) -> None:
    spoil(library)
    expected = digest(ran(crowd(12), 400, kernels="interpreted"))
    world = ran(crowd(12), 400)
    assert (world.kernels, digest(world)) == ("webassembly", expected)
    with pytest.raises(MotorcadeError) as caught:
        CrowdedWorld(crowd(12), [ROAMING], kernels="native")
    assert caught.value.code == code


def test_the_version_says_what_runs_the_cars() -> None:
    command = [sys.executable, "-m", "motorcade", "--version", "--json"]
    said = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    assert (said["kernels"], said["problem"]) == ("native", None)


@pytest.mark.parametrize("name", sorted({library_path().name, "linux-x86_64.so", "engine.wasm"}))
def test_a_backend_proves_itself(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library without the instructions of newer processors is for older ones of this kind."""
    if name == "engine.wasm":
        backend: Backend = WebAssemblyKernels()
    elif name.partition("_64")[0] in library_path().name:
        monkeypatch.setattr("motorcade.engine.native.library_path", lambda: library_path().with_name(name))
        backend = NativeKernels()
    else:
        pytest.skip("a library of another system")
    assert proof(backend) == proof(InterpretedKernels())


def test_words_for_fewer_cars_than_there_are_are_refused() -> None:
    world = ran(crowd(12), 80)
    with pytest.raises(MotorcadeError, match="48 in all"):
        world.begin_words(bytes(4))


def test_a_world_with_threads_runs_on_while_python_ends() -> None:
    """The main thread ends, and a thread of the program's runs its world to its end."""
    script = """
import threading
from motorcade import Program, World, compile_program, forward
from motorcade.mats import playground
main = threading.main_thread()
world = World(playground(), [compile_program(Program([forward(1)])).image], seeds=range(8), threads=2)
def run():
    main.join()
    world.run(400)
    print(world.now_ms)
threading.Thread(target=run).start()
"""
    assert subprocess.check_output([sys.executable, "-c", script], text=True, timeout=DEADLINE_S) == "400\n"


def test_many_worlds_have_memories_of_their_own() -> None:
    worlds = [ran(crowd(12), 400, seeds=seed) for seed in range(10)]
    assert [digest(world) for world in worlds] == [digest(ran(crowd(12), 400, seeds=seed)) for seed in range(10)]


def test_arrays_stay_usable_after_their_world_is_gone() -> None:
    state = ran(crowd(12), 400).state
    rows = state.rows.copy()
    for seed in range(5):
        ran(crowd(12), 400, seeds=seed)
    assert (state.rows == rows).all()


@pytest.mark.parametrize("name", ["llvm", "", "WebAssembly"])
def test_unknown_kernels_are_refused(name: str) -> None:
    with pytest.raises(MotorcadeError, match="native, webassembly, interpreted"):
        ran(crowd(12), 20, kernels=name)


class TestArguments:
    """engine.wasm is called with the arguments that it was made for, or not at all."""

    @staticmethod
    def sort_events(backend: WebAssemblyKernels, *in_order: object) -> None:
        """Call the kernel ``sort_events`` for three events, with ``in_order`` as its last argument."""
        rows = backend.zeros("rows", (3, 6), "uint32")
        rows[:, 0] = 5, 4, 4
        backend.call("sort_events", rows, backend.zeros("order", (2, 3), "int64"), *in_order)

    def test_good_arguments_pass(self) -> None:
        backend = WebAssemblyKernels()
        in_order = backend.zeros("in order", (3, 6), "uint32")
        self.sort_events(backend, in_order)
        assert in_order[:, 0].tolist() == [4, 4, 5]

    @pytest.mark.parametrize(
        ("given", "says"),
        [
            ([np.zeros((3, 6), np.uint32)], "isn't in its memory"),
            ([np.zeros((3, 6), np.int32)], r"sort_events of engine\.wasm expects in_order: uint32, 2-d, C"),
            ([np.zeros(18, np.uint32)], "expects in_order: uint32, 2-d, C"),
            ([np.zeros((3, 12), np.uint32)[:, ::2]], "expects in_order: uint32, 2-d, C"),
            ([6], "expects in_order: uint32, 2-d, C"),
            ([0.5], "expects in_order: uint32, 2-d, C"),
            ([], "None was given"),
        ],
        ids=["here", "dtype", "rank", "strides", "integer", "float", "none"],
    )
    def test_others_are_refused_by_name(self, given: list[object], says: str) -> None:
        with pytest.raises(MotorcadeError, match=says):
            self.sort_events(WebAssemblyKernels(), *given)

    def test_what_is_in_another_memory_is_refused(self) -> None:
        elsewhere = WebAssemblyKernels().zeros("in order", (3, 6), "uint32")
        with pytest.raises(MotorcadeError, match="isn't in its memory"):
            self.sort_events(WebAssemblyKernels(), elsewhere)

    def test_too_many_are_refused(self) -> None:
        backend = WebAssemblyKernels()
        with pytest.raises(MotorcadeError, match="expects None"):
            self.sort_events(backend, backend.zeros("in order", (3, 6), "uint32"), 1)
