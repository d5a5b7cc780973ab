"""``python -m tests.faults --seed N [uploads|driving|fleet|class]``: run one seed, and print what happened."""

import os
import sys

from tests.faults.run import main

try:
    code = main(sys.argv[1:])
    sys.stdout.flush()
except BrokenPipeError:
    # Who reads, such as head, has enough; what is still to be written has nowhere to go.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    code = 1
sys.exit(code)
