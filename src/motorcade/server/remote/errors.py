"""What can go wrong between a remote and its cars: stable codes, and their sentences in English and Chinese."""

from motorcade.errors import MotorcadeError
from motorcade.server.errors import MESSAGES as SERVER_MESSAGES
from motorcade.server.errors import ServerError

MESSAGES: dict[str, dict[str, str]] = {
    "no-such-car": {
        "en": "There is no car {car:.40} here. Choose another one from the list.",
        "zh": "这里没有小车 {car:.40}。请从列表中选择其他小车。",
    },
    "no-seat": {
        "en": "You aren't at car {car:.40}: take a seat there first.",
        "zh": "您还没有进入小车 {car:.40}：请先入座。",
    },
    "too-many-cars": {
        "en": "You are at {most} cars, which is the most at once. Leave one first.",
        "zh": "您已同时进入 {most} 辆小车，已达上限。请先离开一辆。",
    },
    "no-camera-here": {
        "en": "This car has no camera.",
        "zh": "这辆小车没有摄像头。",
    },
    "car-away": {
        "en": "The car went out of reach ({detail}). It stands still, and is looked for again and again.",
        "zh": "无法再联系到小车（{detail}）。它停在原地，正在不断重试连接。",
    },
    # In the words of `motorcade.upload`, whose sentences these are.
    "drive": {"en": "{en}", "zh": "{zh}"},
    "camera": {"en": "{en}", "zh": "{zh}"},
}


class RemoteError(ServerError):
    """Something that a remote asked for and can't have; ``code`` is a key of MESSAGES or one of every server's."""

    messages = SERVER_MESSAGES | MESSAGES


def said(problem: MotorcadeError) -> RemoteError:
    """The error of a car or a camera, as a page gets it."""
    kind = "camera" if problem.http_status == 503 else "drive"
    return RemoteError(kind, problem.http_status, en=problem.sentence("en"), zh=problem.sentence("zh"))
