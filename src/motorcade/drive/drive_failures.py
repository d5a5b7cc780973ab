"""Why a car that is driven says no: stable codes, and their sentences in English and Chinese."""

MESSAGES: dict[str, dict[str, str]] = {
    "full": {
        "en": "This car has its driver and all watchers that it takes, {seats} in all. Wait until one leaves.",
        "zh": "这辆小车的驾驶者和观看者已满，共 {seats} 位。请等有人离开。",
    },
    "enough-of-you": {
        "en": "{most} connections of yours watch this car already. Close one of them.",
        "zh": "您已有 {most} 个连接在观看这辆小车。请关闭其中一个。",
    },
    "no-program": {
        "en": "This car holds no program that it could run.",
        "zh": "这辆小车没有可运行的程序。",
    },
    "not-yours": {
        "en": "The program can't go on: somebody else drives or the emergency stop holds. "
        "Ask for the wheel, or lift the stop.",
        "zh": "程序无法继续：有其他人在驾驶，或处于紧急停止状态。请先取得方向盘，或解除紧急停止。",
    },
    "no-such-connection": {
        "en": "Nobody sends commands from port {port} of this address. Say the port that your commands come from.",
        "zh": "此地址的端口 {port} 没有发送指令的连接。请说明您的指令来自哪个端口。",
    },
    "not-a-request": {
        "en": 'This is no request; one is {{"do": "stop"}}, for example. docs/drive.md lists them.',
        "zh": '这不是请求；请求例如 {{"do": "stop"}}。docs/drive.zh.md 列出了所有请求。',
    },
    "too-long": {
        "en": "A request is a length of four bytes and at most {most} bytes of JSON.",
        "zh": "请求由四字节长度和最多 {most} 字节的 JSON 组成。",
    },
    "too-many-requests": {
        "en": "More than {most} requests a second. Ask less often.",
        "zh": "每秒超过 {most} 个请求。请降低频率。",
    },
}


class DriveError(Exception):
    """A car that is driven says no.

    Attributes:
        code: the stable code, a key of MESSAGES.
        figures: what its sentence is filled in with.
    """

    def __init__(self, code: str, **figures: object) -> None:
        self.code = code
        self.figures = figures
        super().__init__(self.message("en"))

    def message(self, language: str) -> str:
        """The sentence in ``language`` (en or zh)."""
        return MESSAGES[self.code][language].format(**self.figures)
