"""What can go wrong between a driver and a car: stable codes, and their sentences in English and Chinese."""

# The words in braces are filled in per case; {car} is the car's address.
MESSAGES: dict[str, dict[str, str]] = {
    "no-such-host": {
        "en": "There is no address '{car:.60}' here. Is it spelled right, and is this computer in the car's network?",
        "zh": "找不到地址“{car:.60}”。拼写正确吗？这台电脑与小车在同一个网络吗？",
    },
    "no-car-there": {
        "en": "No car answers at {car} ({detail}). Does `motorcade drive serve` run there, and is the address right?",
        "zh": "{car} 处没有小车回答（{detail}）。那里运行着 `motorcade drive serve` 吗？地址对吗？",
    },
    "speaks-no-tls": {
        "en": "The car at {car} doesn't answer by TLS ({detail}). Was it started with --keys? Else leave yours away.",
        "zh": "{car} 处的小车没有以 TLS 回答（{detail}）。启动它时用了 --keys 吗？如果没有，请不要使用您的密钥。",
    },
    "hung-up": {
        "en": "The car at {car} hangs up ({detail}). If it wants keys, show yours: --keys.",
        "zh": "{car} 处的小车挂断了连接（{detail}）。如果它需要密钥，请出示您的：--keys。",
    },
    "away": {
        "en": "The car at {car} has been away for {seconds} s ({detail}). It stands still meanwhile.",
        "zh": "{car} 处的小车已断开 {seconds} 秒（{detail}）。其间它停在原地。",
    },
    "refuses": {
        "en": "The car at {car} says no: {en}",
        "zh": "{car} 处的小车拒绝了：{zh}",
    },
    "another-drives": {
        "en": "The car at {car} took none of it: {driver} drives. Ask for the wheel with `motorcade drive connect`, "
        "or wait 5 s after their last command.",
        "zh": "{car} 处的小车没有执行：{driver} 正在驾驶。请用 `motorcade drive connect` 取得方向盘，"
        "或在对方最后一条指令之后等待 5 秒。",
    },
    "is-stopped": {
        "en": "The car at {car} took none of it: the emergency stop holds. `motorcade drive connect` lifts it with c.",
        "zh": "{car} 处的小车没有执行：处于紧急停止状态。用 `motorcade drive connect` 按 c 解除。",
    },
    "takes-no-requests": {
        "en": "Requests to the car at {car} need its telemetry port.",
        "zh": "向 {car} 处的小车发送请求需要它的遥测端口。",
    },
    "keys-refused": {
        "en": "The car at {car} doesn't accept your keys ({detail}). Are they from the same folder as the car's, "
        "and not over?",
        "zh": "{car} 处的小车不接受您的密钥（{detail}）。它们与小车的密钥出自同一个文件夹吗？是否已过期？",
    },
    "not-trusted": {
        "en": "The car at {car} doesn't show the certificate that your keys expect ({detail}). "
        "Are both from one folder of `motorcade drive keys`, and does it name this address of the car?",
        "zh": "{car} 处的小车没有出示您的密钥所期望的证书（{detail}）。"
        "双方的密钥出自同一个 `motorcade drive keys` 文件夹吗？其中写明了小车的这个地址吗？",
    },
}


class CarError(Exception):
    """Something between a driver and a car.

    Attributes:
        code: a key of MESSAGES; stable.
        figures: what fills the sentence's braces.
    """

    def __init__(self, code: str, **figures: str) -> None:
        self.code = code
        self.figures = figures
        super().__init__(self.message("en"))

    def message(self, language: str) -> str:
        """The sentence in ``language`` (en or zh)."""
        return MESSAGES[self.code][language].format(**self.figures)


class CarNotFoundError(CarError):
    """No car is there."""


class CarAwayError(CarError):
    """The car went away, or doesn't answer."""


class CarRefusesError(CarError):
    """The car says no to this driver, or to a request."""


class CarNotTrustedError(CarError):
    """This isn't the car that the driver's keys trust."""
