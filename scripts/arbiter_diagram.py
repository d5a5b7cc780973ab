"""Draw the states of a driven car (`motorcade.car.arbiter`) as an SVG diagram, in English and Chinese."""

from collections import defaultdict
from xml.sax.saxutils import escape

from motorcade.car.arbiter import EVENTS, STATES, TABLE

WIDTH, HEIGHT = 960, 840
_BOX = (150, 46)
_FRAME = (20, 40, 920, 400)
# The centre and the colour of each state. A new state of the table without an entry here is an error.
_PLACES = {
    "ready": (130, 165, "#dbe9f4"),
    "standing": (480, 80, "#dbe9f4"),
    "moving": (830, 165, "#d5efd5"),
    "failsafe": (480, 385, "#fbe7c6"),
    "program": (830, 350, "#e6dcf5"),
    "disarmed": (200, 310, "#fbe7c6"),
    "stopped": (560, 520, "#f8d3d0"),
    "discharged": (200, 520, "#f8d3d0"),
}
_OUTSIDE = ("stopped", "discharged")
# Events that lead from every state in the frame to one state: the ends of that arrow, and the middle of its label.
_FROM_FRAME = {
    "failsafe": ((20, 385), (405, 385), (200, 375)),
    "stopped": ((600, 440), (600, 497), (715, 494)),
    "program": ((830, 440), (830, 373), (770, 462)),
    "discharged": ((240, 440), (240, 497), (130, 475)),
}
_CHINESE = {
    "ready": ("就绪", "车轮静止，下一条指令即可驾驶"),
    "standing": ("停住", "驾驶者的指令速度为 0"),
    "moving": ("行驶", "驾驶者的指令使车轮转动"),
    "failsafe": ("失效保护", "车轮静止，直到收到一条速度为 0 的指令"),
    "stopped": ("紧急停止", "任何指令都无效"),
    "program": ("程序", "由码字映像驾驶"),
    "disarmed": ("未启用", "新驾驶者的第一条指令速度必须为 0"),
    "discharged": ("电量低", "电池电量低，充电之前车轮不转"),
    "still": ("停", "一条速度为 0 的指令"),
    "move": ("动", "一条速度不为 0 的指令"),
    "silent": ("沉默", "超过 failsafe_ms 没有指令"),
    "stall": ("卡住", "小车自身的软件卡住，或硬件出错"),
    "release": ("交还", "驾驶者交还方向盘，或方向盘转交他人"),
    "gone": ("离开", "驾驶者的连接结束"),
    "stop": ("急停", "紧急停止"),
    "clear": ("解除", "解除紧急停止"),
    "resume": ("恢复", "让程序重新驾驶"),
    "unarmed": ("未先停", "尚未启用小车的驾驶者发来速度"),
    "low": ("电量低", "电池电量低，且车轮静止"),
    "charged": ("已充电", "电池已重新充电"),
}
_TITLES = {"en": "Who drives: the states of a driven car", "zh": "谁在驾驶：受驾驶小车的状态"}
_FROM_ALL_OTHERS = {"en": "from all others in here: ", "zh": "从框内其他状态："}


def arbiter_svg(language: str) -> str:
    """Return the diagram in ``language`` (en or zh)."""
    from_frame, transitions = _transitions()
    parts = [_head(language)]
    left, top, width, height = _FRAME
    parts.append(f'<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="14" class="frame"/>')
    for (begin, end), events in transitions.items():
        labels = " / ".join(_word(event, language) for event in events)
        parts.append(_arrow(_PLACES[begin][:2], _PLACES[end][:2], labels, (end, begin) in transitions))
    for event, following in from_frame.items():
        tail, head, label = _FROM_FRAME[following]
        parts.append(_line(*tail, *head) + _label(*label, _FROM_ALL_OTHERS[language] + _word(event, language)))
    for name, (x, y, colour) in _PLACES.items():
        parts.append(_state(name, x, y, colour, language))
    parts.append(_legend(language))
    return "\n".join([*parts, "</svg>", ""])


def _transitions() -> tuple[dict[str, str], dict[tuple[str, str], list[str]]]:
    """Group the table's transitions.

    Returns:
        The events that lead from all states in the frame to one state, with that state; and the events of the other
        transitions by first and next state.
    """
    by_event: dict[tuple[str, str], set[str]] = defaultdict(set)
    for before, what, after in TABLE:
        by_event[EVENTS[what][0], STATES[after][0]].add(STATES[before][0])
    from_frame: dict[str, str] = {}
    transitions: dict[tuple[str, str], list[str]] = defaultdict(list)
    framed = {name for name, _ in STATES if name not in _OUTSIDE}
    for (event, following), states in by_event.items():
        if states >= framed - {following}:
            from_frame[event] = following
            continue
        for state in sorted(states, key=list(_PLACES).index):
            transitions[state, following].append(event)
    return from_frame, transitions


def _word(name: str, language: str) -> str:
    return name if language == "en" else _CHINESE[name][0]


def _head(language: str) -> str:
    title = escape(_TITLES[language])
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}"'
    return f"""<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{title}">
<title>{title}</title>
<style>
text {{ font: 15px sans-serif; fill: #1c2733; text-anchor: middle }}
.legend, .legend tspan {{ text-anchor: start; font-size: 14px }}
.name {{ font-weight: bold }}
.label {{ paint-order: stroke; stroke: #fff; stroke-width: 6px; font-size: 14px }}
.frame {{ fill: #fff; stroke: #8a97a5; stroke-dasharray: 6 5 }}
.arrow {{ stroke: #3d4c5c; stroke-width: 1.6; fill: none; marker-end: url(#tip) }}
.state {{ stroke: #3d4c5c; stroke-width: 1.4 }}
</style>
<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="auto">
<path d="M0 0 10 5 0 10z" fill="#3d4c5c"/></marker></defs>
<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>"""


def _state(name: str, x: int, y: int, colour: str, language: str) -> str:
    width, height = _BOX
    box = f'<rect x="{x - width // 2}" y="{y - height // 2}" width="{width}" height="{height}" rx="10"'
    return (
        f'{box} fill="{colour}" class="state"/>\n<text x="{x}" y="{y + 5}" class="name">{_word(name, language)}</text>'
    )


def _arrow(begin: tuple[int, int], end: tuple[int, int], label: str, has_opposite: bool) -> str:
    """Draw an arrow between two boxes; beside the line between their centres where there is an arrow back."""
    (x0, y0), (x1, y1) = begin, end
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    along_x, along_y = (x1 - x0) / length, (y1 - y0) / length
    offset = 13 if has_opposite else 0
    x0, x1, y0, y1 = (
        x0 - along_y * offset,
        x1 - along_y * offset,
        y0 + along_x * offset,
        y1 + along_x * offset,
    )
    margin = min(_BOX[0] / 2 / max(abs(along_x), 1e-9), _BOX[1] / 2 / max(abs(along_y), 1e-9))
    x0, y0, x1, y1 = x0 + along_x * margin, y0 + along_y * margin, x1 - along_x * margin, y1 - along_y * margin
    share = 0.36
    at_x, at_y = x0 + (x1 - x0) * share, y0 + (y1 - y0) * share + 5
    return _line(x0, y0, x1, y1) + _label(at_x, at_y, label)


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    return f'<path d="M{x0:.1f} {y0:.1f} {x1:.1f} {y1:.1f}" class="arrow"/>'


def _label(x: float, y: float, text: str) -> str:
    return f'\n<text x="{x:.0f}" y="{y:.0f}" class="label">{escape(text)}</text>'


def _legend(language: str) -> str:
    lines = []
    for column, rows in enumerate((STATES, EVENTS)):
        for row, (name, meaning) in enumerate(rows):
            word, text = (name, meaning) if language == "en" else _CHINESE[name]
            x, y = 30 + 470 * column, 580 + 20 * row
            lines.append(
                f'<text x="{x}" y="{y}" class="legend"><tspan font-weight="bold">{escape(word)}</tspan> '
                f"{escape(text)}</text>"
            )
    return "\n".join(lines)
