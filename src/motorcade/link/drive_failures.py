"""Why a car that is driven says no: stable codes, and their sentences in English and Chinese."""

MESSAGES: dict[str, dict[str, str]] = {
    "full": {
        "en": "This car has its driver and all watchers that it takes, {seats} in all. Wait until one leaves.",
        "zh": "这辆小车的驾驶者和观看者已满，共 {seats} 位。请等有人离开。",
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
