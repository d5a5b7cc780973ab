"""Try changed copies of the code: pytest collects the tests once, and a child of it for each copy runs them.

mutmut's own runner lets pytest start and collect anew for each copy, which takes longer than most copies live.
"""

import os
import re
import resource
import signal
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import pytest
from mutmut.mutation.trampoline import set_mutant_under_test

# Functions that run on import, or whose results are kept: pytest has called them before it changes anything, so a
# copy that the tests notice nothing of is imported and tried anew.
ON_IMPORT = re.compile(r"motorcade\.(words\.(field|formats|switches)\.|words\.infrared\.x__mask)")
# What an operating system and mutmut call the end of a copy.
SURVIVED, FOUND, TOO_SLOW = 0, 1, 36
# The nearest tests of a function that runs on import: they judge it first, since all others take long to import.
_NEAREST = ("--hypothesis-profile=mutants", "tests/words/test_formats.py")
# A copy that loops for ever ends after this many times the processor's time of a test, and at last by the clock.
_PATIENCE, _LEAST_S, _LONGEST_S = 3, 10, 900


def _end_after(duration_s: float) -> None:
    """Let the system end this process where what takes ``duration_s`` unchanged takes far longer now."""
    limit_s = int(time.process_time() + _LEAST_S + _PATIENCE * duration_s)
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, resource.RLIM_INFINITY))


@dataclass(frozen=True)
class Copy:
    """A changed copy: its name, the tests that reach it, and the seconds that they take unchanged, at most."""

    name: str
    tests: frozenset[str]
    duration_s: float


class Trial:
    """A plugin of pytest that, in place of running the tests, tries one copy after the other in children.

    ``durations_s`` says how long each test takes: quick ones come first, since the first that fails is enough.
    ``told`` takes each copy's name and how it ended.
    """

    def __init__(
        self,
        copies: Iterable[Copy],
        durations_s: dict[str, float],
        told: Callable[[str, int], None],
        arguments: list[str],
    ) -> None:
        self._copies = sorted(copies, key=lambda copy: copy.duration_s)
        self._durations_s = durations_s
        self._told = told
        self._arguments = arguments
        self._children: dict[int, tuple[Copy, float]] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Try all copies, as many at once as there are processors."""
        items = sorted(session.items, key=lambda item: self._durations_s.get(item.nodeid, 0))
        for copy in self._copies:
            while len(self._children) >= (os.cpu_count() or 1):
                self._wait()
            child = os.fork()
            if child == 0:
                os._exit(self._judge(copy, session, items))
            self._children[child] = copy, time.monotonic() + _LONGEST_S
        while self._children:
            self._wait()
        return True

    def _judge(self, copy: Copy, session: pytest.Session, items: list[pytest.Item]) -> int:
        set_mutant_under_test(copy.name)
        chosen = [item for item in items if item.nodeid in copy.tests]
        for item, following in zip(chosen, [*chosen[1:], None], strict=True):
            _end_after(self._durations_s.get(item.nodeid, 0))
            session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if session.testsfailed:
                return FOUND
        if not ON_IMPORT.match(copy.name):
            return SURVIVED
        _end_after(copy.duration_s)
        return FOUND if self._fails_anew(*_NEAREST) or self._fails_anew(*self._arguments) else SURVIVED

    @staticmethod
    def _fails_anew(*arguments: str) -> bool:
        for name in [each for each in sys.modules if each.partition(".")[0] in ("motorcade", "support", "tests")]:
            del sys.modules[name]
        return pytest.main(["-x", "-q", *arguments]) != pytest.ExitCode.OK

    def _wait(self) -> None:
        ended, status = os.waitpid(-1, os.WNOHANG)
        if ended == 0:
            time.sleep(0.02)
            for child, (_, until) in self._children.items():
                if time.monotonic() > until:
                    os.kill(child, signal.SIGKILL)
            return
        copy, _ = self._children.pop(ended)
        self._told(copy.name, os.WEXITSTATUS(status) if os.WIFEXITED(status) else TOO_SLOW)
