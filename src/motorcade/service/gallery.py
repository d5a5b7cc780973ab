"""Example programs to begin with, each with a mat where it shows what it can do."""

from importlib import resources
from typing import NamedTuple

from starlette.routing import BaseRoute

from motorcade.server.http import get
from motorcade.server.studio.settings import Settings
from motorcade.service.documents import Project, opened
from motorcade.service.errors import StudioError


class Example(NamedTuple):
    """A program of the gallery; its file is ``gallery/<id>.motorcade.json``."""

    id: str
    title: dict[str, str]
    about: dict[str, str]


EXAMPLES = (
    Example(
        "square",
        {"en": "A square", "zh": "走正方形"},
        {"en": "A leader alone drives a square, for ever.", "zh": "一辆主机独自反复走正方形。"},
    ),
    Example(
        "traffic-light",
        {"en": "Traffic light", "zh": "红绿灯"},
        {
            "en": "The leader stands still and lights its LEDs in turn: a word needn't move anything.",
            "zh": "主机停在原地，依次点亮 LED：码字不一定要让小车移动。",
        },
    ),
    Example(
        "parade",
        {"en": "Parade", "zh": "列队行进"},
        {
            "en": "The followers drive what the leader drives, each where it stands.",
            "zh": "从机与主机走同样的路线，各自从自己的位置出发。",
        },
    ),
    Example(
        "dance",
        {"en": "Dance", "zh": "舞蹈"},
        {
            "en": "The leader turns in the middle; the dancers go out, turn round and come back.",
            "zh": "主机在中间转动；舞者向外走，转身，再回来。",
        },
    ),
    Example(
        "ripple",
        {"en": "Ripple", "zh": "涟漪"},
        {
            "en": "The leader reaches only the first car of a line. Each passes the word on, and a light runs down it.",
            "zh": "主机只能传到队列中的第一辆车。每辆车转发码字，灯光便沿着队列传下去。",
        },
    ),
    Example(
        "herd",
        {"en": "Herd", "zh": "牧群"},
        {
            "en": "All wander about at random and keep away from the obstacles and from each other.",
            "zh": "所有小车随意漫步，避开障碍物，也避开彼此。",
        },
    ),
    Example(
        "listen",
        {"en": "Red light, green light", "zh": "一二三木头人"},
        {
            "en": "The cars stop when somebody says 'stop' and drive on at 'go'. Say it yourself with the buttons.",
            "zh": "有人说“停”时小车停下，说“走”时继续前进。您也可以用按钮来说。",
        },
    ),
    Example(
        "polite",
        {"en": "After you", "zh": "您先请"},
        {
            "en": "The car waits while a person stands before it, and drives on when they have gone.",
            "zh": "有人站在前面时小车会等待，等人走开后再继续前进。",
        },
    ),
)


def routes(settings: Settings) -> list[BaseRoute]:
    """The gallery, the same for all."""
    return [
        get("/api/examples", lambda request: [example._asdict() for example in EXAMPLES]),
        get("/api/examples/{id}", lambda request: opened_example(request.path_params["id"])),
    ]


def opened_example(example_id: str) -> Project:
    """An example's Project. Raises StudioError."""
    if example_id not in {example.id for example in EXAMPLES}:
        raise StudioError("no-example", 404, name=example_id[:40])
    return opened((resources.files(__package__) / "gallery" / f"{example_id}.motorcade.json").read_bytes())
