"""What can be wrong with a pin file: stable codes, and their sentences in English and Chinese."""

from motorcade.errors import Sentences

# The words in braces are filled in per case: {where} is the file and the table in it, {car} the car's name.
PINS: Sentences = {
    "unreadable": {
        "en": "the pin file {where} can't be read: {reason}",
        "zh": "无法读取引脚文件 {where}：{reason}",
    },
    "no-toml": {
        "en": "the pin file {where} is not TOML: {reason}",
        "zh": "引脚文件 {where} 不是 TOML：{reason}",
    },
    "unknown-key": {
        "en": "{where}: '{key}' is not known; known are {known}",
        "zh": "{where}：没有 '{key}' 这一项；可用的有 {known}",
    },
    "missing-key": {
        "en": "{where}: '{key}' is missing",
        "zh": "{where}：缺少 '{key}'",
    },
    "format": {
        "en": "{where}: format is {value}; it has to be '{format}'",
        "zh": "{where}：format 是 {value}；应为 '{format}'",
    },
    "name": {
        "en": "{where}: name is {value}; allowed: a line of 1 to {most} characters",
        "zh": "{where}：name 是 {value}；应为一行 1 到 {most} 个字符",
    },
    "chip": {
        "en": "{where}: chip is {value}; allowed: {known}",
        "zh": "{where}：chip 是 {value}；可用的有 {known}",
    },
    "no-device": {
        "en": "{where}: no device is connected; devices are {known}",
        "zh": "{where}：没有连接任何部件；可用的部件有 {known}",
    },
    "no-table": {
        "en": "{where}: {key} is a table of its own: [{key}]",
        "zh": "{where}：{key} 应是单独的表：[{key}]",
    },
    "no-pins": {
        "en": "{where}: no pin is named; known are {known}",
        "zh": "{where}：没有写引脚；可用的有 {known}",
    },
    "no-number": {
        "en": "{where}: {wire} is {value}; a pin is a whole number, such as 17",
        "zh": "{where}：{wire} 是 {value}；引脚应为整数，例如 17",
    },
    "taken": {
        "en": "{where}: {wire} is {value}, but GPIO{value} of {chip} {use}; choose another pin",
        "zh": "{where}：{wire} 是 {value}，但 {chip} 的 GPIO{value} {use}；请换一个引脚",
    },
    "no-such-pin": {
        "en": "{where}: {wire} is {value}, but {chip} has no such pin; it has {pins}",
        "zh": "{where}：{wire} 是 {value}，但 {chip} 没有这个引脚；可用的有 {pins}",
    },
    "only-reads": {
        "en": "{where}: {wire} is {value}, but GPIO{value} of {chip} only reads, and this wire has to be driven",
        "zh": "{where}：{wire} 是 {value}，但 {chip} 的 GPIO{value} 只能输入，而这根线需要输出",
    },
    "same-pin": {
        "en": "{where}: {wire} and {other} are both on {pin}; give one of them another pin",
        "zh": "{where}：{wire} 与 {other} 都接在 {pin}；请给其中一个换一个引脚",
    },
    "duties": {
        "en": "{where}: {key} is {value}; allowed: {count} whole numbers that rise from 0 to at most {most}, one for "
        "each speed level",
        "zh": "{where}：{key} 是 {value}；应为 {count} 个从 0 递增、不超过 {most} 的整数，每个速度档位一个",
    },
    "microcontroller": {
        "en": "the pin file is that of {car}, with the chip {chip}: such a board gets its programs by "
        "`motorcade install-firmware`",
        "zh": "这是 {car} 的引脚文件，芯片为 {chip}：这种板子用 `motorcade install-firmware` 安装程序",
    },
    "no-wheels": {
        "en": "the pin file of {car} has no wheels: they are either [left_motor] and [right_motor], or "
        "[drive_motor] and [servo]",
        "zh": "{car} 的引脚文件没有车轮：应有 [left_motor] 和 [right_motor]，或 [drive_motor] 和 [servo]",
    },
    "two-kinds-of-wheels": {
        "en": "the pin file of {car} has two kinds of wheels: they are either [left_motor] and [right_motor], or "
        "[drive_motor] and [servo]",
        "zh": "{car} 的引脚文件有两种车轮：只能有 [left_motor] 和 [right_motor]，或 [drive_motor] 和 [servo]",
    },
    "no-receiver": {
        "en": "the pin file of {car} has no receiver in [infrared], by which a follower hears words",
        "zh": "{car} 的引脚文件在 [infrared] 中没有 receiver，从机要靠它接收码字",
    },
    "no-micropython": {
        "en": "{car}: MicroPython cars have {known}, and this is {chip}",
        "zh": "{car}：MicroPython 小车使用 {known}，而这是 {chip}",
    },
    "no-voice-map": {
        "en": "{car} has a voice module: say with --voice-map what it sends for which word",
        "zh": "{car} 有语音模块：请用 --voice-map 说明它为每个口令发送什么",
    },
    "voice-uart-sends": {
        "en": "{car}: GPIO{pin} belongs to the voice module's UART: give what is there another pin",
        "zh": "{car}：GPIO{pin} 属于语音模块的 UART：请给接在那里的部件换一个引脚",
    },
    "no-uart": {
        "en": "{car}: {wire} is {value}, and no UART of an RP2040 has that pin for it",
        "zh": "{car}：{wire} 是 {value}，RP2040 没有哪个 UART 以该引脚作此用途",
    },
    "two-uarts": {
        "en": "{car}: the pins of {device} belong to different UARTs of the RP2040",
        "zh": "{car}：{device} 的引脚属于 RP2040 的不同 UART",
    },
    "uart-in-use": {
        "en": "{car}: the voice module is at the UART that uploads come by; take the other one",
        "zh": "{car}：语音模块接在接收上传的 UART 上；请改用另一个",
    },
}
NO_TEXT = {"en": "it is no text", "zh": "不是文本文件"}


def ranges(runs: list[list[int]]) -> dict[str, str]:
    """Runs of pins, each a first and a last one, in words such as ``2 to 27``, by language."""
    to, comma = {"en": " to ", "zh": " 到 "}, {"en": ", ", "zh": "、"}
    return {
        language: comma[language].join(
            f"{first}" if first == last else f"{first}{to[language]}{last}" for first, last in runs
        )
        for language in to
    }
