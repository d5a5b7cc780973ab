"""Real documents and messages, and what becomes of them when anything in them is replaced."""

import json
import re
from functools import cache
from pathlib import Path

from hypothesis import strategies as st

from motorcade.drive.keys import with_end
from motorcade.program.python_writer import python_text
from motorcade.service.documents import EXAMPLES, example, project_text
from motorcade.service.programs import program_of

ROOT = Path(__file__).parents[2]
_PIECES = re.compile(r"[\w.+-]+|\s+|.", re.DOTALL)
# What no document has, and a reader may meet.
_STRANGE = (
    *("-1", "0", "1e999", "-0.0", "nan", "inf", "9" * 4400, "1_0", "0x1f", "true", "null", "[" * 200, '{"a":' * 200),
    *("{", "}", "[", "]", '"', "'", "=", ":", ",", "#", '"""', "\\ud800", "\ud800", "\0", "\r", "\u202e", "é", "车"),
)
MAT = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "tick_ms": 20,
    "size_m": [2, 2],
    "car": [{"at_m": [0.5, 0.5], "role": "leader"}, {"at_m": [1, 0.5]}],
}
CAR_LISTS = (
    'ada = "192.168.1.20:7001"\n"\u963f\u8fbe" = "/dev/ttyUSB0"\n',
    'truck = "drive://10.0.0.7:5005"\nbo = "[fe80::1]:9"\nd = "COM3"\n',
    'x = "spy:///dev/null?file=kept.txt"\ny = "socket://127.0.0.1:7001"\n',
)
REVOKED = (
    with_end("# Serial numbers of drivers' keys that are no longer valid, one a line.\n4a3f  # lin\n10  # mei\n"),
    with_end("4A3F\n"),
    with_end(""),
)
IMAGE = "AgEBAGTAAABqgAAAboAAAA=="
DRIVE_REQUESTS = tuple(
    json.dumps({"do": do, "port": 1, "clock": 5, "number": 1, "stamp": 7})
    for do in ("join", "request", "release", "stop", "clear", "resume", "sync", "other")
)
WORLD_MESSAGES = tuple(
    json.dumps({"do": do, **more})
    for do, more in (
        ("set", {"mat": MAT, "image": IMAGE, "seed": 1, "range_mm": 500, "mission": {"id": "forward-and-stop"}}),
        ("set", {"mat": MAT, "image": IMAGE, "profile": "classroom"}),
        *(("play", {"speed": 4.0}), ("pause", {}), ("step", {"ticks": 100}), ("reset", {"seed": 2, "until_ms": 5000})),
        ("stop-when", {"conditions": [{"kind": "touch", "car": 0, "thing": "edge"}, {"kind": "lost"}]}),
        ("stop-when", {"conditions": [{"kind": "zone", "disc": [1, 1, 0.2]}, {"kind": "block", "words": [1]}]}),
        ("stop-when", {"conditions": [{"kind": "zone", "corners_m": [[0, 0], [1, 0], [1, 1]]}, {"kind": "stuck"}]}),
        *(("say", {"word": "stop"}), ("set_environment", {"mat": MAT, "range_mm": 700})),
        *(
            ("move", {"car": 1, "x_m": 1.5, "y_m": 1.5, "heading_deg": 90}),
            ("watch", {"car": 1}),
            ("watch", {"car": None}),
        ),
        *(("seek", {"t_ms": 100}), ("seek", {"t_ms": None}), ("shown", {"frame": 1}), ("resume", {"car": 0})),
    )
)
REMOTE_MESSAGES = tuple(
    json.dumps({"do": do, **more})
    for do, more in (
        *((do, {"car": "1"}) for do in ("join", "leave", "request", "release", "clear", "resume")),
        ("drive", {"cars": ["1"], "throttle": 0.0, "steering": 0.0, "number": 1, "stamp": 3}),
        ("drive", {"cars": ["1"], "throttle": 1.0, "steering": -0.5, "switches": {"horn": 1}, "number": 2, "stamp": 4}),
        *(("stop", {"cars": ["1"]}), ("sync", {"clock": 5, "number": 1, "stamp": 5}), ("start", {})),
    )
)
CLASS_MESSAGES = tuple(
    json.dumps(each)
    for each in (
        {"title": "3b", "is_open": True, "frozen": False, "stopped": True, "may_drive": True},
        *({"pupil": "01", "name": "小明"}, {"number": 1}, {"raised": True}, {"name": "", "wants": True}),
        *({"name": "red", "pupil": "01"}, {"window": "leader", "wants": True}, {"wants": False}, {}),
        {"playing": True, "t_ms": 5, "speed": 2.0, "run": 1, "mat": MAT},
        {"pupil": "02", "mission": {"id": "forward-and-stop"}, "text": "good"},
    )
)


@cache
def projects() -> tuple[str, ...]:
    """The project files of the examples."""
    return tuple(project_text(example(name)) for name in EXAMPLES)


@cache
def python_texts() -> tuple[str, ...]:
    """Python text: what Motorcade writes for the examples, and what people wrote."""
    programs = (program_of(each.leader, each.followers, each.profile) for each in map(example, EXAMPLES))
    written = (ROOT / "examples" / f"{name}.py" for name in ("dance", "listen", "parade", "polite", "wander"))
    return (*map(python_text, programs), *(file.read_text(encoding="utf-8") for file in written))


def toml_files(*folders: str) -> tuple[str, ...]:
    """The texts of the TOML files in folders of the repository."""
    files = (file for folder in folders for file in sorted((ROOT / folder).glob("*.toml")))
    return tuple(file.read_text(encoding="utf-8") for file in files)


@st.composite
def damaged(draw: st.DrawFn, texts: tuple[str, ...]) -> str:
    """One of the texts, in which up to five pieces are replaced by others, by strange ones, or by nothing."""
    pieces = list(_split(draw(st.sampled_from(texts))))
    pool = st.sampled_from(_pool(texts)) | st.sampled_from(_STRANGE) | st.text(max_size=3)
    for _ in range(draw(st.integers(0, 5))):
        at = draw(st.integers(0, len(pieces)))
        pieces[at : at + draw(st.integers(0, 3))] = draw(st.lists(pool, max_size=3))
    return "".join(pieces)


@cache
def _split(text: str) -> tuple[str, ...]:
    return tuple(_PIECES.findall(text))


@cache
def _pool(texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(sorted({piece for text in texts for piece in _split(text)}))
