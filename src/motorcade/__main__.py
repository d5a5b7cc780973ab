"""Start the command line: the command `motorcade`, and `python -m motorcade`."""

import sys
from typing import NoReturn

_STOPPED = 130


def main() -> NoReturn:
    """Run the command line. Ctrl-C while its modules are imported ends it without a traceback."""
    try:
        from motorcade.cli import main as run_command_line

        run_command_line()
    except KeyboardInterrupt:
        sys.exit(_STOPPED)


if __name__ == "__main__":
    main()
