"""What can go wrong on the way from here onto a board: stable codes, and their sentences in English and Chinese."""

from collections.abc import Mapping

from motorcade.upload.failures import NoAnswerError, PortError, RefusedError, VerificationError, WentAwayError

MESSAGES: dict[str, dict[str, str]] = {
    "no-micropython": {
        "en": "No MicroPython answers at {port}. Press the board's reset button and try again. If there is none on it "
        "yet, put it there first: https://micropython.org/download has it for ESP32 and Raspberry Pi Pico.",
        "zh": "{port} 处没有 MicroPython 应答。请按一下板上的复位键再试。如果板上还没有 MicroPython，请先安装："
        "https://micropython.org/download 提供 ESP32 和 Raspberry Pi Pico 的版本。",
    },
    "another-chip": {
        "en": "The board at {port} is of the kind '{found}', and {wanted}. "
        "Name a pin file that fits with --pins, or plug in the other board.",
        "zh": "{port} 处的板子类型是“{found}”，而{wanted_zh}。请用 --pins 指定合适的引脚文件，或换上另一块板子。",
    },
    "old-micropython": {
        "en": "The board at {port} has MicroPython {found}; {needed} or newer is needed: "
        "https://micropython.org/download",
        "zh": "{port} 处的板子运行 MicroPython {found}；需要 {needed} 或更新的版本：https://micropython.org/download",
    },
    "no-room": {
        "en": "The board at {port} has {free} KB free, and {needed} KB are needed. Delete files that it doesn't need: "
        "`mpremote connect {port} ls` lists them.",
        "zh": "{port} 处的板子还剩 {free} KB，需要 {needed} KB。请删除不需要的文件："
        "`mpremote connect {port} ls` 可列出它们。",
    },
    "install-cut-off": {
        "en": "The board at {port} went away in the middle. It does not start as a car until all of it is there: "
        "plug it in and run the same command again.",
        "zh": "{port} 处的板子中途断开了。固件完整之前它不会作为小车启动：请重新插好，再运行同一条命令。",
    },
    "install-failed": {
        "en": "The board at {port} could not write {path}: {reason}. Run the same command again; "
        "where that doesn't help, erase its flash and put MicroPython on it anew.",
        "zh": "{port} 处的板子无法写入 {path}（{reason}）。请再运行一次同一条命令；"
        "如果仍然不行，请擦除闪存并重新安装 MicroPython。",
    },
    "file-differs": {
        "en": "The file {path} on the board at {port} differs from what was sent. Run the same command again.",
        "zh": "{port} 处板子上的文件 {path} 与发送的不同。请再运行一次同一条命令。",
    },
}


class _InstallError(PortError):
    """One of the sentences above."""

    def message(self, language: str, instead: Mapping[str, Mapping[str, str]] | None = None) -> str:
        return super().message(language, {**MESSAGES, **(instead or {})})


class NoMicroPythonError(_InstallError, NoAnswerError):
    """Nothing that speaks as MicroPython's prompt does."""


class UnfitBoardError(_InstallError, RefusedError):
    """A board of another kind, too old, too full, or one that can't write."""


class FileDiffersError(_InstallError, VerificationError):
    """A file arrived as something else."""


class InstallCutOffError(_InstallError, WentAwayError):
    """The line broke off in the middle."""
