"""Ask at a terminal what a ruler shows after the moves of a car that is measured."""

import sys
from collections.abc import Callable

import typer

from motorcade.cli.output import print_note, print_problem, translated
from motorcade.config.calibration import MOVES, Move, Reading, check_readings, readings_of
from motorcade.errors import MotorcadeError

# What a person types to measure the move before once more.
_BACK = "-"


def ask_readings(send: Callable[[Move], None]) -> dict[str, list[Reading]]:
    """Return one or more readings of each of MOVES; ``send`` brings a move to the car.

    An answer that can't be is refused in a sentence, and asked for again.
    """
    print_note(translated("calibrate-begins"))
    readings: dict[str, list[Reading]] = {}
    sent = ""
    while len(readings) < len(MOVES):
        move = MOVES[len(readings)]
        if move.key != sent:
            send(move)
            sent = move.key
            print_note(translated("calibrate-move", number=len(readings) + 1, count=len(MOVES), move=move.title))
        key = "calibrate-angle" if move.turns else "calibrate-way"
        answer = _answer(translated(key), move)
        if answer.strip() == _BACK and readings:
            readings.popitem()
            continue
        try:
            found = readings_of(move, answer)
            check_readings({**readings, move.key: found})
        except MotorcadeError as problem:
            print_problem(problem)
        else:
            readings[move.key] = found
    return readings


def _answer(question: str, move: Move) -> str:
    """Return what a person answers, or the next line of a file. Raises MotorcadeError where a file has no more."""
    try:
        return str(typer.prompt(question, err=True))
    except typer.Abort:
        if sys.stdin.isatty():
            raise
        raise MotorcadeError("reading-missing", move=move.title) from None
