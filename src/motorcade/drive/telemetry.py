"""What a car that is driven tells of itself, and of each one's commands."""

from typing import NamedTuple

# By what a command gives back: the arbiter's five, and one of `motorcade.drive.session`.
OUTCOMES = ("applied", "watching", "needs-neutral", "stopped", "program", "over-rate")
OVER_RATE = 5


class Telemetry(NamedTuple):
    """What the car does and who drives it.

    Attributes:
        state: name of a state of `motorcade.car.arbiter`, ``ready`` to ``program``.
        angle_deg, direction, speed: what is applied; 90, 1 and 0 are neutral.
        driver: name of the seat that drives, or None.
        wanted_by: name of the seat that waits for the wheel, or None.
        age_ms: since the driver's last command, or None where nobody drives.
        battery_mv: the battery's voltage, or None where nothing measures it.
        watchers: how many are there beside the driver.
        refused: words that were no DRIVE words.
        failsafes: how often moving wheels were stopped since their driver fell silent or was gone.
        stalls: how often the car's own software was stuck.
        faults: how often its hardware failed; ``last_fault`` says why.
        turned_away: connections that got or kept no place, or failed to show who they are.
    """

    state: str
    angle_deg: int
    direction: int
    speed: int
    driver: str | None
    wanted_by: str | None
    age_ms: int | None
    battery_mv: int | None
    watchers: int
    refused: int
    failsafes: int
    stalls: int
    faults: int
    last_fault: str
    turned_away: int


class Counts:
    """What became of one seat's words.

    Attributes:
        outcomes: how many commands had each of OUTCOMES.
        refused: words that were no DRIVE words; ``last_refusal`` says what was wrong with the last.
        superseded: words that were never looked at, as newer ones lay behind them.
    """

    def __init__(self) -> None:
        self.outcomes = [0] * len(OUTCOMES)
        self.refused = 0
        self.superseded = 0
        self.last_refusal = ""

    def as_dict(self) -> dict[str, int | str]:
        """All of them by name."""
        counted: dict[str, int | str] = dict(zip(OUTCOMES, self.outcomes, strict=True))
        counted |= {"refused": self.refused, "superseded": self.superseded, "last_refusal": self.last_refusal}
        return counted
