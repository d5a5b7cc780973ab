"""Whatever arguments public methods get, they give a result or a sentence, and Python goes on."""

import os
import subprocess
import sys
from pathlib import Path

from support.absurd_calls import TARGETS
from support.soak import SOAK
from support.waiting import DEADLINE_S

EXAMPLES, DEADLINES = ("20000", 40) if SOAK else ("300", 8)


def test_absurd_arguments_are_refused_with_a_sentence():
    command = [sys.executable, "-m", "support.absurd_calls", EXAMPLES]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, timeout=DEADLINES * DEADLINE_S, check=False
    )
    # The last line names the call that ended the process.
    assert done.returncode == 0, done.stdout[-300:] + done.stderr[-3000:]
    assert {line.partition(" ")[0] for line in done.stdout.splitlines()} == {*TARGETS}
