"""What is exported together: Motorcade's three formats, or one of a user's own."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from motorcade.words.field import Field, WordFormat
from motorcade.words.fingerprint import fingerprint
from motorcade.words.formats import FORMATS

# By format and field; the declarations that run on cars have no room for them.
_CHINESE_MEANINGS = {
    ("header", "leader_states"): "其后有多少个主机控制字",
    ("header", "follower_words"): "再其后有多少个从机控制字",
    ("header", "dwell"): "每个从机码字的发送时长：独热码，8 个档位",
    ("header", "reserved"): "保留，用于扩展",
    ("control", "accept_ir"): "从机接受红外信息",
    ("control", "forward"): "用红外转发码字",
    ("control", "motor_enable"): "驱动马达",
    ("control", "motor_direction"): "0 前进，1 左转，2 右转，3 随机前进",
    ("control", "motor_speed"): "0 静止，至 3 最快",
    ("control", "motor_duration"): "档位 0（0 秒）至 3（最长）",
    ("control", "led_which"): "LED 0 至 3",
    ("control", "led_duration"): "档位 0（0 秒，即不亮）至 3（最长）",
    ("control", "avoid_enable"): "超声波避障",
    ("control", "avoid_radius"): "避障半径，档位 0（最近）至 3",
    ("control", "avoid_duration"): "档位 0（0 秒）至 3（最长）",
    ("control", "voice"): "听从语音“停”和“走”",
    ("control", "pir"): "感应到人体时静止",
    ("control", "reserved"): "保留，用于扩展",
    ("control", "parity"): "奇偶校验：红外发送时置位，使 1 的个数为偶数",
    ("drive", "code"): "指令代号：1 为速度和方向",
    ("drive", "angle"): "舵机角度；90 居中，小于 90 偏右",
    ("drive", "direction"): "1 前进，0 后退",
    ("drive", "speed"): "PWM 占空比，0 至 255",
    ("drive", "reserved"): "保留，用于扩展",
}


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Formats that one export speaks of.

    Attributes:
        name: an identifier, part of the exported files' names.
        formats: at least one.
        chinese_meanings: by the names of format and field; where one is missing, the declared meaning stands.
    """

    name: str
    formats: tuple[WordFormat, ...]
    chinese_meanings: Mapping[tuple[str, str], str] = field(default_factory=dict)

    @property
    def file_stem(self) -> str:
        """What the exported files' names begin with."""
        return f"motorcade_{self.name}"

    @property
    def has_images(self) -> bool:
        """Whether these formats make images: a header and control words behind it."""
        return {"header", "control"} <= {word_format.name for word_format in self.formats}

    def meaning(self, word_format: WordFormat, of: Field, language: str) -> str:
        """What a field means, in ``language`` (en or zh)."""
        if language == "zh":
            return self.chinese_meanings.get((word_format.name, of.name), of.meaning)
        return of.meaning


MOTORCADE = Vocabulary("words", FORMATS, _CHINESE_MEANINGS)


def fingerprint_text(word_format: WordFormat) -> str:
    """The fingerprint as it stands in every export: ``0x`` and 8 digits."""
    return f"0x{fingerprint(word_format):08X}"


def field_notes(of: Field) -> str:
    """All that is said about a field beside its name and bits, in one line."""
    notes = [of.meaning]
    if of.unit:
        notes.append(f"in {of.unit}")
    if of.reserved:
        notes.append("written 0")
    else:
        notes.append(str(of.allowed))
    if of.goes_with:
        notes.append(f"0 exactly where {of.goes_with} is 0")
    if of.needs:
        notes.append(f"no effect unless {of.needs} is 1")
    return "; ".join(notes)
