"""What can go wrong between here and a car: stable codes, and their sentences in English and Chinese."""

from collections.abc import Mapping

from motorcade.upload.transfer import OLD, Retry
from motorcade.words.image import refused_image
from motorcade.words.upload import IMAGE, MISMATCH, OTHER_CHECKSUM, REFUSED, SILENT, Outcome

# The words in braces are filled in per case; {detail} is what the car itself said.
# Behind each sentence comes one of HOLDS, where it is known that something was sent.
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
    "no-car-found": {
        "en": "No car is found at any USB port. Plug it in, or name its port with --port; `motorcade ports` lists all.",
        "zh": "在 USB 端口上没有找到小车。请把它插好，或用 --port 指定端口；用 `motorcade ports` 可列出全部端口。",
    },
    "several-ports": {
        "en": "A car may be at any of these ports: {list}. Choose one with --port.",
        "zh": "小车可能在以下任一端口：{list}。请用 --port 指定一个。",
    },
    "no-serial-port": {
        "en": "{port} is no serial port. `motorcade ports` lists those that are.",
        "zh": "{port} 不是串口。用 `motorcade ports` 可列出串口。",
    },
    "port-forbidden": {
        "en": "You may not use {port}. On Linux join the group {group}: sudo usermod -aG {group} $USER, "
        "then log out and in again.",
        "zh": "您无权使用 {port}。在 Linux 上请加入用户组 {group}："
        "sudo usermod -aG {group} $USER，然后注销并重新登录。",
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
        "en": "The car at {port} went away in the middle. Is its cable loose?",
        "zh": "{port} 处的小车中途断开了。线松了吗？",
    },
    "nothing-to-read": {
        "en": "Nothing to read at {port}: {detail}. Is the car switched on?",
        "zh": "从 {port} 没有读到完整的映像：小车没有回答，或中途停止了。它开机了吗？",
    },
    "refused": {
        "en": "The car at {port} refused: {detail}.",
        "zh": "{port} 处的小车拒绝接收（它回答：{detail}）。",
    },
    "mismatch": {
        "en": "Something else arrived at the car at {port} than was sent: {detail}. Is its cable loose or very long?",
        "zh": "到达 {port} 处小车的内容与发送的不同。线松了或太长吗？",
    },
    "no-image": {
        "en": "The car at {port} sent no image: {detail}.",
        "zh": "{port} 处的小车发来的不是映像（{detail}）。",
    },
}
# What the car holds after an upload that failed, by `motorcade.upload.transfer`.
HOLDS: dict[str, dict[str, str]] = {
    "old": {
        "en": "It keeps the image that it had.",
        "zh": "它保留原有的映像。",
    },
    "either": {
        "en": "It holds the image that it had or the new one, whole, and could not say which. Upload again.",
        "zh": "它存有原来的或新的完整映像，但未能说明是哪一个。请重新上传。",
    },
    "neither": {
        "en": "It holds another image now, which may be damaged. Upload again before you let it drive.",
        "zh": "它现在存有另一个映像，可能已损坏。请重新上传后再让它行驶。",
    },
    "unknown": {
        "en": "What it holds now is not known. Upload again.",
        "zh": "无法得知它现在存有什么。请重新上传。",
    },
}
# Why there is another try.
RETRIES: dict[str, dict[str, str]] = {
    "asks-again": {
        "en": "The car gave no clear answer. Asking it again, {number} of {of}.",
        "zh": "小车没有明确回答。正在再次询问：第 {number} 次，共 {of} 次。",
    },
    "sends-again": {
        "en": "The program did not arrive whole. Sending it again, {number} of {of}.",
        "zh": "程序没有完整到达。正在重新发送：第 {number} 次，共 {of} 次。",
    },
    "reads-again": {
        "en": "The car's program did not arrive whole. Reading it again, {number} of {of}.",
        "zh": "小车的程序没有完整到达。正在重新读取：第 {number} 次，共 {of} 次。",
    },
}


class PortError(Exception):
    """Something between here and the car.

    Attributes:
        code: a key of MESSAGES; stable.
        arguments: what fills the sentence's braces; ``holds``, a key of HOLDS, where the car may have changed.
    """

    def __init__(self, code: str, **arguments: str):
        self.code = code
        self.arguments = arguments
        super().__init__(self.message("en"))

    def message(self, language: str, instead: Mapping[str, Mapping[str, str]] | None = None) -> str:
        """The sentences in ``language`` (en or zh); ``instead`` has other words for some codes."""
        sentence = ((instead or {}).get(self.code) or MESSAGES[self.code])[language].format(**self.arguments)
        if not (holds := self.arguments.get("holds")):
            return sentence
        return sentence + (" " if language == "en" else "") + HOLDS[holds][language]


class PortNotFoundError(PortError):
    """There is no such port."""


class SeveralPortsError(PortError):
    """Somebody has to choose: ``ports`` are pairs of a device and what is there."""

    def __init__(self, ports: list[tuple[str, str]]):
        self.ports = ports
        super().__init__("several-ports", list=", ".join(f"{device} ({title})" for device, title in ports))


class PortBusyError(PortError):
    """The port, or the car behind it, is in use by someone else."""


class PortForbiddenError(PortError):
    """This user may not use the port."""


class NoAnswerError(PortError):
    """The car said nothing."""


class RefusedError(PortError):
    """The car said no."""


class VerificationError(PortError):
    """What arrived, there or here, is something else than was sent."""


class WentAwayError(PortError):
    """The line broke off in the middle."""


def retry_sentence(retry: Retry, language: str) -> str:
    """What is said of another try, in ``language`` (en or zh)."""
    return RETRIES[retry.reason][language].format(number=retry.number, of=retry.of)


def upload_failure(port: str, outcome: Outcome, holds: str) -> PortError | None:
    """What an upload's outcome (`motorcade.words.upload`) says went wrong; None where nothing did.

    ``holds`` is a key of HOLDS.
    """
    kind, detail = outcome
    if kind == SILENT:
        return NoAnswerError("no-answer", port=port, detail=detail, holds=holds)
    if kind == MISMATCH or (kind == REFUSED and str(detail).startswith(OTHER_CHECKSUM)):
        return VerificationError("mismatch", port=port, detail=detail, holds=holds)
    if kind != REFUSED:
        return None
    if str(detail).startswith("busy"):
        # What it had before the other upload isn't what it will have.
        return PortBusyError("car-busy", port=port, holds="" if holds == OLD else holds)
    return RefusedError("refused", port=port, detail=str(refused_image(str(detail)) or detail), holds=holds)


def readback_failure(port: str, outcome: Outcome) -> PortError | None:
    """What a readback's outcome says went wrong; None where nothing did."""
    kind, detail = outcome
    if kind == IMAGE:
        return None
    if kind == SILENT:
        return NoAnswerError("nothing-to-read", port=port, detail=detail)
    if str(detail).startswith("busy"):
        return PortBusyError("car-busy", port=port)
    return VerificationError("no-image", port=port, detail=detail)
