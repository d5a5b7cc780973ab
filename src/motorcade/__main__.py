"""`python -m motorcade` is the command `motorcade`."""

from motorcade.cli import main

main()
