"""Settings and fixtures for all tests."""

import gc
import os
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Generator, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock
from hypothesis import Phase, settings

# A failed assertion of a helper says why, too.
pytest.register_assert_rewrite("support")

from support.processor_time import cpu_s  # noqa: E402

# Tests start hundreds of processes, each of which would compile all of Motorcade anew where Python may store nothing.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# What a shell starts in the background ignores Ctrl-C, and by nohup the end of the terminal; so would all processes
# that tests start. They get a signal's own default in place of a handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)

# The same examples in each run, so that a failure comes from the change; `make soak` draws many more.
settings.register_profile("quick", deadline=None, derandomize=True, max_examples=40)
settings.register_profile("few", deadline=None, derandomize=True, max_examples=20)
# For code that was changed on purpose: which example fails doesn't matter, so none is made smaller.
phases = (Phase.explicit, Phase.generate)
settings.register_profile("mutants", settings.get_profile("few"), phases=phases, database=None)
settings.register_profile("soak", deadline=None, max_examples=1_000)
settings.load_profile("quick")


HERE = Path(__file__).parent
# What the tests of a folder need besides Python; `make quick` runs those that need nothing.
MARKERS = {"browser": "browser", "site": "browser", "arduino": "chip", "portable": "chip", "firmware": "chip"}
MARKERS["export"] = "chip"
MARKERS |= dict.fromkeys(("cameras", "classroom", "cli", "faults", "fleet", "server", "upload"), "server")
# Their tests wait for pages, processes and sockets: one that fails runs once more (docs/adr/0042-second-try.md).
SECOND_TRY = {"browser", "site", "server", "classroom", "upload", "cameras", "cli", "drive", "fleet"}

# What takes longest begins first, so that all processes end together: these folders and files, then all others, none
# of whose files takes ten seconds.
FIRST = (
    *("faults", "browser", "test_docs.py", "missions", "test_wheel.py", "cli", "engine", "arduino", "portable"),
    *("test_extras.py", "test_architecture.py", "firmware", "site", "export"),
)
# The most processor time of one test, in seconds: what is over it belongs to `make soak`, or does something twice.
MOST_CPU_S = 20
CPU_PROPERTY = "cpu_s"
BEGAN_AT_CPU_S = pytest.StashKey[float]()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark each test by its folder, order them, and leave out those that `make soak` and ``-m soak`` run."""
    for item in items:
        folder = _folder(item.path)
        if folder in MARKERS:
            item.add_marker(MARKERS[folder])
        if folder in SECOND_TRY:
            item.add_marker(pytest.mark.flaky(reruns=1))
    # Not above: pytest chooses the profile after it has read this file.
    from support.soak import SOAK

    wanted = SOAK or "soak" in config.option.markexpr
    waiting = [item for item in items if not wanted and item.get_closest_marker("soak")]
    if waiting:
        config.hook.pytest_deselected(items=waiting)
        items[:] = [item for item in items if not item.get_closest_marker("soak")]
    items.sort(key=_order)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """Let the garbage collector rest while all tests are imported and listed, and pass over them afterwards.

    They live as long as the process: to look at all of them took half a second each time.
    """
    gc.disable()
    result = yield
    gc.freeze()
    gc.enable()
    return result


@cache
def _folder(path: Path) -> str:
    """Return the folder of tests that has a file, or the file's own name."""
    return path.relative_to(HERE).parts[0]


def _order(item: pytest.Item) -> int:
    """Return the place of a test's folder in `FIRST`; sorting keeps the order of the tests of a folder."""
    folder = _folder(item.path)
    return FIRST.index(folder) if folder in FIRST else len(FIRST)


@pytest.fixture(scope="session")
def install_lock() -> FileLock:
    """A lock to take while something is installed: `make test` runs the tests in several processes."""
    # Not above: the tests of changed code run in a folder without scripts.
    from scripts import debian

    return FileLock(debian.LOCK)


@pytest.fixture(scope="session")
def page_lock() -> FileLock:
    """A lock to take while the page is built."""
    return FileLock(Path(tempfile.gettempdir()) / "motorcade-tests-page.lock")


@pytest.fixture(scope="session")
def build_lock() -> FileLock:
    """A lock to take while something is built or installed that takes long, and that few tests need."""
    return FileLock(Path(tempfile.gettempdir()) / "motorcade-tests-build.lock")


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """The number of processes that run the tests: three more than processors, since many tests wait.

    Those of `make quick` don't, and ask for no more than processors: each process imports the tests first.
    """
    processors = os.cpu_count() or 1
    if config.option.numprocesses == "logical":
        return processors
    return processors + 3


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Note how much processor time a test took, so that the report of its end brings it to the summary."""
    yield
    item.user_properties.append((CPU_PROPERTY, cpu_s() - item.stash[BEGAN_AT_CPU_S]))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note the processor time at which a test begins."""
    item.stash[BEGAN_AT_CPU_S] = cpu_s()


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Print which tests were skipped or failed at first, and why, so that nobody overlooks them."""
    skipped = Counter(
        str(each.longrepr[2]).removeprefix("Skipped: ") for each in terminalreporter.getreports("skipped")
    )
    for reason, count in skipped.items():
        terminalreporter.write_sep("!", f"{count} tests did NOT run: {reason}", red=True, bold=True)
    for report in (report for reports in terminalreporter.stats.values() for report in reports):
        used_s = dict(getattr(report, "user_properties", ())).get(CPU_PROPERTY, 0)
        if used_s > MOST_CPU_S:
            text = f"{used_s:.0f} s of processor time, of at most {MOST_CPU_S}: {report.nodeid}"
            terminalreporter.write_sep("!", text, red=True, bold=True)
    for each in terminalreporter.getreports("rerun"):
        terminalreporter.write_sep("!", f"ran twice, since it failed at first: {each.nodeid}", red=True, bold=True)


class FailuresAtOnce:
    """Tells of each failure when it happens: a run that something ends from outside never comes to its summary."""

    def __init__(self, terminal: Any) -> None:
        self._terminal = terminal

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Print what failed, also where it runs once more."""
        if report.outcome not in ("failed", "rerun"):
            return
        self._terminal.ensure_newline()
        self._terminal.write_sep("!", f"{report.outcome} in {report.when}: {report.nodeid}", red=True, bold=True)
        self._terminal.write_line(report.longreprtext)
        for title, text in report.sections:
            self._terminal.write_sep("-", title)
            self._terminal.write_line(text)


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Let the process that prints tell of failures at once."""
    if terminal := config.pluginmanager.get_plugin("terminalreporter"):
        config.pluginmanager.register(FailuresAtOnce(terminal))
