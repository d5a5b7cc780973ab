"""``python -m tests.faults --seed N [uploads|driving|fleet|class]``: run one seed, and print what happened."""

import sys

from tests.faults.run import main

sys.exit(main(sys.argv[1:]))
