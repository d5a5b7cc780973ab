"""A recorded run on a terminal: a map of characters that moves, with the clock and what was counted."""

import time
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.text import Text

from motorcade.runs.box import whole_box
from motorcade.runs.character_map import CharacterMap, CharacterMaps

if TYPE_CHECKING:
    from motorcade.engine.moment import Moment
from motorcade.runs.recording import Recording

_MOST_COLUMNS = 120
_MOST_ROWS = 40
_LEAST = 8
_NAMES = {
    "frames": "sent",
    "heard": "heard",
    "lost_collision": "collided",
    "lost_sending": "missed while sending",
    "lost_parity": "wrong parity",
    "lost_reserved": "reserved bits",
    "deaf": "deaf",
}


def show_live(recording: "Recording", speed: float) -> None:
    """Play the recording, ``speed`` simulated seconds a second, until its end or Ctrl-C."""
    console = Console()
    columns = max(_LEAST, min(console.width - 4, _MOST_COLUMNS))
    rows = max(_LEAST, min(console.height - 5, _MOST_ROWS))
    plain = not console.encoding.startswith("utf")
    maps = CharacterMaps(recording.about, whole_box(recording), columns, rows, plain)
    title = f"{recording.about.mat}, {recording.about.cars:,} car{'' if recording.about.cars == 1 else 's'}"
    began = time.monotonic()
    try:
        with Live(console=console, auto_refresh=False) as live:
            for frame in recording.frames():
                early_s = frame.t_ms / 1000 / speed - (time.monotonic() - began)
                if early_s > 0:
                    time.sleep(early_s)
                live.update(_picture(maps.draw(frame), frame, title), refresh=True)
    except KeyboardInterrupt:
        return


def _picture(drawn: CharacterMap, frame: "Moment", title: str) -> Group:
    text = Text(no_wrap=True, end="")
    for row, colours in zip(drawn.characters, (drawn.colours * 255).astype(int), strict=True):
        # One style for each stretch of one colour.
        ends = np.flatnonzero(np.any(colours[1:] != colours[:-1], axis=1)) + 1
        for first, last in zip([0, *ends.tolist()], [*ends.tolist(), len(row)], strict=True):
            red, green, blue = colours[first].tolist()
            text.append("".join(row[first:last]), style=f"rgb({red},{green},{blue})")
        text.append("\n")
    text.rstrip()
    counted = ", ".join(f"{frame.counts[name]:,} {label}" for name, label in _NAMES.items() if frame.counts.get(name))
    status = Text(f"{frame.t_ms / 1000:.1f} s   {f'frames: {counted}' if counted else ''}", no_wrap=True)
    return Group(Panel(text, title=title, expand=False), status)
