"""What can be said about a program: stable codes, and their sentences in English and Chinese."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

from motorcade.errors import MotorcadeError

Severity = Literal["error", "warning"]
LANGUAGES = ("en", "zh")

# The words in braces are filled in per case. "leader-accepts-ir" and "too-many-states"
# keep the wording of seed 000 (c1 2.1.1 and h1 1.0.1, whose 并行 is an erratum for 串行).
MESSAGES: dict[str, dict[str, str]] = {
    "not-json": {
        "en": "This is not a JSON file: {reason}.",
        "zh": "这不是 JSON 文件：{reason}。",
    },
    "unknown-field": {
        "en": "'{name}' can't stand here. What can: {allowed}.",
        "zh": "此处不能有“{name}”。可以有：{allowed}。",
    },
    "several-kinds": {
        "en": "A step is exactly one of {kinds}; here are {present}. To start several at once, put them in a together.",
        "zh": "一个步骤只能是 {kinds} 中的一种；这里有 {present}。要并行执行，请放进 together。",
    },
    "missing-field": {
        "en": "Here something is missing: {name}.",
        "zh": "此处缺少：{name}。",
    },
    "duplicate-field": {
        "en": "'{name}' stands twice in one pair of braces. Keep one of them.",
        "zh": "同一对花括号中“{name}”出现了两次。请只保留一个。",
    },
    "bad-profile": {
        "en": "The profile can't be used: {reason}.",
        "zh": "无法使用该车型文件：{reason}。",
    },
    "out-of-range": {
        "en": "The value is {value}; allowed: {allowed}.",
        "zh": "此处的值是 {value}；允许：{allowed}。",
    },
    "leader-accepts-ir": {
        "en": "A leader can't be set to accept infrared. Take this setting off the step.",
        "zh": "无法设置主机接受红外信息。请去掉这一步的设置。",
    },
    "too-many-states": {
        "en": "The serial modules in use are more than 255: they make {count} states. "
        "The costliest step, {costliest}, makes {cost} of them: shorten it or repeat it less often.",
        "zh": "所用的串行模块数目已经大于255：共 {count} 个状态。"
        "占用最多的一步是 {costliest}（{cost} 个状态）：请缩短它或减少重复次数。",
    },
    "too-many-words": {
        "en": "The followers' program needs {count} words, and 255 is the most. "
        "The costliest step, {costliest}, needs {cost} of them: shorten it or repeat it less often.",
        "zh": "从机程序需要 {count} 个码字，最多为 255 个。"
        "占用最多的一步是 {costliest}（{cost} 个码字）：请缩短它或减少重复次数。",
    },
    "parallel-conflict": {
        "en": "Two steps of one kind ({kinds}) can't start together: a car has only one of it. "
        "Put one behind the other.",
        "zh": "同一种步骤（{kinds}）不能并行：小车只有一个。请将它们改为串行。",
    },
    "duration-not-expressible": {
        "en": "{seconds} s can't be made of the car's durations. The nearest that can: {nearest}.",
        "zh": "小车的时长档位无法组成 {seconds} 秒。最接近的可用时长：{nearest}。",
    },
    "dwell-not-expressible": {
        "en": "No sending time fits: {reason}. The car can send a word for {dwells} s.",
        "zh": "没有合适的发送时长：{reason}。每个码字可以发送 {dwells} 秒。",
    },
    "empty-program": {
        "en": "There are no steps here yet: the car stands still.",
        "zh": "这里还没有任何步骤：小车会静止不动。",
    },
    "deaf-followers": {
        "en": "This step makes followers deaf for {deaf} s, longer than the {dwell} s for which a word is sent: "
        "what is sent meanwhile passes them by.",
        "zh": "这一步使从机在 {deaf} 秒内不接收红外，超过每个码字的发送时长 {dwell} 秒：期间发送的码字会被错过。",
    },
    "echo": {
        "en": "Followers pass their words on, and there are {count} different ones: "
        "an old word can come back and overwrite a new one.",
        "zh": "从机会转发码字，而码字共有 {count} 个：旧的码字可能传回来覆盖新的码字。",
    },
    "bad-blocks": {
        "en": "These blocks can't be read: the file that they come from is damaged. Open another version of it.",
        "zh": "无法读取这些积木：它们所在的文件已损坏。请打开另一个版本。",
    },
    "unknown-block": {
        "en": "There is no block '{type}' here. Take it away.",
        "zh": "这里没有“{type}”积木。请将它移除。",
    },
    "second-hat": {
        "en": "The block that everything begins with stands here twice. Take one of them away.",
        "zh": "起始积木出现了两次。请移除其中一个。",
    },
    "too-many-in-a-row": {
        "en": "More than {most} blocks stand one behind the other, more than a car can hold. Use a repeat block.",
        "zh": "相连的积木超过 {most} 个，小车装不下。请使用重复积木。",
    },
    "blocks-too-deep": {
        "en": "Blocks stand more than {most} deep inside each other. Take some of them out.",
        "zh": "积木嵌套超过 {most} 层。请取出一些。",
    },
    "not-inside-together": {
        "en": "This block can't start together with others. Put it around the together block, or behind it.",
        "zh": "此积木不能放在并行积木里面。请放在它的外面或后面。",
    },
}

# Phrases that fill the braces, where they differ by language.
PHRASES: dict[str, dict[str, str]] = {
    "whole-range": {"en": "a whole number from {minimum} to {maximum}", "zh": "{minimum} 到 {maximum} 的整数"},
    "range": {"en": "a number from {minimum} to {maximum}", "zh": "{minimum} 到 {maximum} 的数"},
    "boolean": {"en": "true or false", "zh": "true 或 false"},
    "string": {"en": "text in quotation marks", "zh": "引号中的文字"},
    "list": {"en": "a list [...]", "zh": "列表 [...]"},
    "object": {"en": "an object {{...}}", "zh": "对象 {{...}}"},
    "object-or-null": {"en": "an object {{...}} or null", "zh": "对象 {{...}} 或 null"},
    "one-kind": {"en": "exactly one of {kinds}", "zh": "{kinds} 中的恰好一个"},
    "nothing": {"en": "nothing", "zh": "（无）"},
    "or": {"en": "{first} s or {second} s", "zh": "{first} 秒或 {second} 秒"},
    "single": {"en": "{first} s", "zh": "{first} 秒"},
    "step-not-a-dwell": {
        "en": "this step lasts {seconds} s",
        "zh": "这一步持续 {seconds} 秒",
    },
    "step-takes-no-time": {
        "en": "this step takes no time, and a word is sent for at least one",
        "zh": "这一步不占用时间，而每个码字至少要发送一段时间",
    },
    "dwell-not-a-level": {
        "en": "{seconds} s is not one of the sending times",
        "zh": "{seconds} 秒不是可用的发送时长",
    },
    "steps-disagree": {
        "en": "the steps' lengths have no sending time in common",
        "zh": "各步的时长没有共同的发送时长",
    },
    "step-not-one-word": {
        "en": "with a sending time of its own each step is one word, and {seconds} s is longer than one",
        "zh": "指定发送时长后每一步是一个码字，而 {seconds} 秒超过一个码字的时长",
    },
    "too-deep": {"en": "its brackets are nested too deeply", "zh": "括号嵌套过深"},
    "not-text": {"en": "it is not UTF-8 text", "zh": "它不是 UTF-8 文本"},
    "bad-number": {"en": "{number} is not a number of JSON's", "zh": "{number} 不是 JSON 的数"},
    "syntax": {"en": "line {line}, column {column}: {reason}", "zh": "第 {line} 行第 {column} 列有语法错误"},
}


@dataclass(frozen=True, slots=True)
class Phrase:
    """Part of a message that differs by language."""

    key: str
    arguments: tuple[tuple[str, Any], ...] = ()

    def text(self, language: str) -> str:
        """The phrase in ``language`` (en or zh)."""
        return PHRASES[self.key][language].format(**dict(self.arguments))


def phrase(key: str, **arguments: Any) -> Phrase:
    """The Phrase ``key`` of PHRASES with its braces filled."""
    return Phrase(key, tuple(arguments.items()))


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing to say about a program.

    Attributes:
        code: a key of MESSAGES; stable.
        severity: error or warning; an error means that there are no words.
        path: the place in the JSON, such as ``leader[2].together[0]``.
        id: the step's id (the block it came from), where it has one.
        arguments: what fills the message's braces.
    """

    code: str
    severity: Severity
    path: str
    id: str | None = None
    arguments: tuple[tuple[str, Any], ...] = ()

    def message(self, language: str = "en") -> str:
        """The sentence in ``language`` (en or zh)."""
        values = {name: _said(value, language) for name, value in self.arguments}
        return MESSAGES[self.code][language].format(**values)

    def as_dict(self, language: str = "en") -> dict[str, Any]:
        """The diagnostic for JSON."""
        return {
            "code": self.code,
            "severity": self.severity,
            "message": self.message(language),
            "path": self.path,
            "id": self.id,
        }


def _said(value: Any, language: str) -> Any:
    if isinstance(value, Phrase):
        return value.text(language)
    return value.sentence(language) if isinstance(value, MotorcadeError) else value


def error(code: str, path: str, step_id: str | None = None, **arguments: Any) -> Diagnostic:
    """A Diagnostic that stops the program from being compiled."""
    return Diagnostic(code, "error", path, step_id, tuple(arguments.items()))


def warning(code: str, path: str, step_id: str | None = None, **arguments: Any) -> Diagnostic:
    """A Diagnostic that the user should know of."""
    return Diagnostic(code, "warning", path, step_id, tuple(arguments.items()))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether any of them is an error."""
    return any(diagnostic.severity == "error" for diagnostic in diagnostics)


class ProgramError(ValueError):
    """A program that can't be read or compiled; ``diagnostics`` says why."""

    def __init__(self, diagnostics: Iterable[Diagnostic]):
        self.diagnostics = tuple(diagnostics)
        super().__init__("; ".join(f"{each.path}: {each.message()}" for each in self.diagnostics))
