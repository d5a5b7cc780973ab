"""The cars of a site's page have the same bits as those of a computer: its worker, Pyodide and V8 against native code.

`tests/engine/test_backends.py` compares more worlds, with wasmtime in the place of a browser.
"""

import json
import runpy
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade.mats import read_mat
from motorcade.missions.document import missions
from motorcade.program.blocks_reader import program_of
from motorcade.program.compiler import compile_program
from motorcade.service.documents import EXAMPLES as GALLERY
from motorcade.service.documents import example
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import SetWorld
from support.brain_steps import STEPS_OF_A_LINE, sums
from support.hashes_in_site import REQUEST, digests, packed, with_digests
from support.site_server import PATH
from support.soak import SOAK
from support.studio_page import StudioPage
from support.world_hash import page_hash
from support.worlds import ROAMING, Case, CrowdedWorld, cases

EXAMPLES = Path(__file__).parents[2] / "examples"
FEW = settings(max_examples=max(settings().max_examples // 10, 1))
RUN_MS = 20_000 if SOAK else 400
# The worker's own code takes the message and posts the answer.
ASK = """([name, message]) => new Promise((done) => {
    const post = self.postMessage
    self.postMessage = (answer, ...rest) => {
        if (answer.id !== -1) return post.call(self, answer, ...rest)
        self.postMessage = post
        done(answer.answer)
    }
    self.onmessage({ data: { is: "ask", id: -1, name, message } })
})"""


@pytest.fixture(scope="module")
def ask(browser, studio_of_site, tmp_path_factory):
    """Asks Python in a page's worker for digests."""
    own = tmp_path_factory.mktemp("python")
    [archive] = studio_of_site.folder.glob("python-*/python.zip")
    changed = own / PATH.strip("/") / archive.relative_to(studio_of_site.folder)
    changed.parent.mkdir(parents=True)
    changed.write_bytes(with_digests(archive.read_bytes()))
    studio = StudioPage.open(browser, studio_of_site.url, build=own)
    [worker] = studio.page.workers
    yield lambda what, *arguments: json.loads(worker.evaluate(ASK, [REQUEST, packed(what, *arguments)]))
    studio.context.close()
    assert studio.faults == []


def on_this_computer(mat, images, profile, seed, durations_ms):
    return digests(
        CrowdedWorld(mat, images, profile, seeds=seed, events=True, threads=1, kernels="native"), durations_ms
    )


@FEW
@given(cases())
def test_any_world_has_the_same_bits(ask, case: Case) -> None:
    run_ms = [100 * case.mat.tick_ms] * 3
    world = (case.mat, case.images, case.profile, case.seed, run_ms)
    assert ask("world", *world) == on_this_computer(*world)


def documents():
    """Every mat, every mission with its solution, and every program of the examples on a mat with followers."""
    mats = [(path.stem, read_mat(path)) for path in sorted((EXAMPLES / "mats").iterdir())]
    yield from ((name, mat, ROAMING, None) for name, mat in mats)
    for each in missions():
        yield each.id, each.mat, compile_program(each.solution, each.profile).image, each.profile
    classroom = dict(mats)["classroom"]
    of_scripts = {path.stem: runpy.run_path(str(path)).get("program") for path in sorted(EXAMPLES.glob("*.py"))}
    files = [example(name) for name in GALLERY]
    of_page = {f"page-{n}": program_of(each.leader, each.followers, each.profile) for n, each in enumerate(files)}
    for name, program in {**of_scripts, **of_page}.items():
        if program:
            yield name, classroom, compile_program(program).image, None


def test_all_mats_missions_and_examples_have_the_same_bits(ask) -> None:
    for name, mat, image, profile in documents():
        world = (mat, [image], profile, 7, [RUN_MS // mat.tick_ms * mat.tick_ms])
        assert ask("world", *world) == on_this_computer(*world), name


@FEW
@given(st.integers(0, (1 << 32) - 1), st.integers(1, 4000))
def test_a_page_gets_the_same_bytes(ask, seed: int, range_mm: int) -> None:
    mat = {
        "format": "motorcade-mat/1",
        "name": "a hall",
        "size_m": [3, 3],
        "edge": "wall",
        "crowd": [{"cars": 30, "leaders": 2, "placement": "random", "seed": seed}],
        "wall": [{"from_m": [1, 1], "to_m": [2, 1]}],
        "voice": [{"at_s": 1, "word": "stop"}],
    }
    message = SetWorld(mat, ROAMING, seed=seed, range_mm=range_mm)
    assert ask("page", message, 1500, 7) == page_hash(open_world(message, 100), 1500, 7)


def test_the_brain_in_python_does_the_same(ask) -> None:
    steps = (32 if SOAK else 4) * STEPS_OF_A_LINE
    assert ask("brain", 5, steps) == sums(5, steps)
