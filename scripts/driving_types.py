"""Write what driver and page send when as TypeScript: web/src/generated/driving.ts."""

import json

from scripts.typescript import constant, interface

from motorcade.drive import deadman, stamps
from motorcade.words.formats import SWITCHES

_HEAD = """/**
 * When a page sends its stick, as motorcade.drive.deadman and stamps say. Written by scripts/generate.py; don't edit.
 */
"""


def driving_types() -> str:
    """Return the text of driving.ts."""
    states, events = ([name for name, _ in rows] for rows in (deadman.STATES, deadman.EVENTS))
    table: dict[str, dict[str, str]] = {state: {} for state in states}
    for state, event, following in deadman.TABLE:
        table[states[state]][events[event]] = states[following]
    lasts = {states[state]: lasts_ms for state, lasts_ms in deadman.LASTS_MS}
    switches = [{"name": each.name, "held": each.is_held, "key": each.key} for each in SWITCHES]
    return "\n".join(
        [
            _HEAD,
            *_union("DeadmanState", deadman.STATES),
            *_union("DeadmanEvent", deadman.EVENTS),
            "/** The next state for a state and an event; an event that isn't there changes nothing. */",
            constant("NEXT", table, "Record<DeadmanState, Partial<Record<DeadmanEvent, DeadmanState>>>"),
            "/** After how long a state gets the event `over`. */",
            constant("LASTS_MS", lasts, "Partial<Record<DeadmanState, number>>"),
            "/** How often a command is sent. */",
            constant("PERIOD_MS", deadman.PERIOD_MS),
            "/** How long a command counts. */",
            constant("FRESH_MS", deadman.FRESH_MS),
            "/** A stamp counts steps of so many milliseconds, and comes round after so many of them. */",
            f"export const STAMP_STEP_MS = {stamps.STEP_MS};",
            f"export const STAMP_STEPS = {stamps.STEPS};\n",
            "/** What a driver switches beside the wheels, with its key; one that is held goes off when released. */",
            interface("Switch", ("name: string", "held: boolean", "key: string")),
            constant("SWITCHES", switches, "readonly Switch[]"),
        ]
    )


def _union(name: str, rows: tuple[tuple[str, str], ...]) -> list[str]:
    about = [f" * - {key}: {meaning}" for key, meaning in rows]
    return ["/**", *about, " */", f"export type {name} = {' | '.join(json.dumps(key) for key, _ in rows)};\n"]
