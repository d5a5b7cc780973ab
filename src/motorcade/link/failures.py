"""What can go wrong between here and a car: stable codes, and their sentences in English and Chinese."""

from motorcade.words.upload import IMAGE, MISMATCH, REFUSED, SILENT

# The words in braces are filled in per case; {detail} is what the car itself said.
MESSAGES: dict[str, dict[str, str]] = {
    "no-port-named": {
        "en": "No port is named. `motorcade ports` lists those that are there.",
        "zh": "没有指定端口。用 `motorcade ports` 可列出现有的端口。",
    },
    "not-a-port-name": {
        "en": "'{port:.60}' is not the name of a port. `motorcade ports` lists them.",
        "zh": "“{port:.60}”不是端口名称。用 `motorcade ports` 可列出端口。",
    },
    "no-such-port": {
        "en": "There is no port {port}. Is the cable in? `motorcade ports` lists what is there.",
        "zh": "没有端口 {port}。线插好了吗？用 `motorcade ports` 可列出现有的端口。",
    },
    "no-serial-port": {
        "en": "{port} is no serial port. `motorcade ports` lists those that are.",
        "zh": "{port} 不是串口。用 `motorcade ports` 可列出串口。",
    },
    "port-forbidden": {
        "en": "You may not use {port}. On Linux join the group that owns it (often dialout): "
        "sudo usermod -aG dialout $USER, then log in again.",
        "zh": "您无权使用 {port}。在 Linux 上请加入拥有它的用户组（通常是 dialout）："
        "sudo usermod -aG dialout $USER，然后重新登录。",
    },
    "port-busy": {
        "en": "The port {port} is busy: close the other program that uses it.",
        "zh": "端口 {port} 正被占用：请关闭正在使用它的其他程序。",
    },
    "car-busy": {
        "en": "The car at {port} is busy with another uploader. Try again when it is done.",
        "zh": "{port} 处的小车正在接收另一次上传。请等它完成后再试。",
    },
    "no-answer": {
        "en": "The car at {port} gave {detail}. Is the car switched on, and the baud rate right? "
        "For a board that never answers use --no-verify.",
        "zh": "{port} 处的小车没有回答。小车开机了吗？波特率对吗？对于从不回答的板子，请使用 --no-verify。",
    },
    "takes-no-bytes": {
        "en": "The car at {port} takes no more bytes. Is it switched on?",
        "zh": "{port} 处的小车不再接收数据。它开机了吗？",
    },
    "went-away": {
        "en": "The car at {port} went away in the middle: it holds the old image or the new one. Try again.",
        "zh": "{port} 处的小车中途断开了：它存有旧的或新的映像。请重试。",
    },
    "nothing-to-read": {
        "en": "Nothing to read at {port}: {detail}. Is the car switched on?",
        "zh": "从 {port} 没有读到完整的映像：小车没有回答，或中途停止了。它开机了吗？",
    },
    "refused": {
        "en": "The car at {port} refused: {detail}. It keeps the image that it had.",
        "zh": "{port} 处的小车拒绝接收（它回答：{detail}）。它保留原有的映像。",
    },
    "mismatch": {
        "en": "The car at {port} holds something else than was sent: {detail}. Upload again.",
        "zh": "{port} 处的小车所存的内容与发送的不同。请重新上传。",
    },
    "no-image": {
        "en": "The car at {port} sent no image: {detail}.",
        "zh": "{port} 处的小车发来的不是映像（{detail}）。",
    },
}


class PortError(Exception):
    """Something between here and the car.

    Attributes:
        code: a key of MESSAGES; stable.
        arguments: what fills the sentence's braces.
    """

    def __init__(self, code: str, **arguments: str):
        self.code = code
        self.arguments = arguments
        super().__init__(self.message("en"))

    def message(self, language: str) -> str:
        """The sentence in ``language`` (en or zh)."""
        return MESSAGES[self.code][language].format(**self.arguments)


class PortNotFoundError(PortError):
    """There is no such port."""


class PortBusyError(PortError):
    """The port is in use by someone else, or this user may not use it."""


class NoAnswerError(PortError):
    """The car said nothing, or went away."""


class VerificationError(PortError):
    """The car refused the image or holds another one than was sent."""


def upload_failure(port: str, kind: str, detail: str) -> PortError | None:
    """What an upload's outcome (`motorcade.words.upload`) says went wrong; None where nothing did."""
    if kind == SILENT:
        return NoAnswerError("no-answer", port=port, detail=detail)
    if kind == MISMATCH:
        return VerificationError("mismatch", port=port, detail=detail)
    return _refusal("refused", port, detail) if kind == REFUSED else None


def readback_failure(port: str, kind: str, detail: str) -> PortError | None:
    """What a readback's outcome says went wrong; None where nothing did."""
    if kind == IMAGE:
        return None
    if kind == SILENT:
        return NoAnswerError("nothing-to-read", port=port, detail=detail)
    return _refusal("no-image", port, detail)


def _refusal(code: str, port: str, detail: str) -> PortError:
    if detail.startswith("busy"):
        return PortBusyError("car-busy", port=port)
    return VerificationError(code, port=port, detail=detail)
