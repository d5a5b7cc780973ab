"""Why there is no picture: stable codes, and their sentences in English and Chinese."""

from motorcade.errors import Sentences, ToldError

MESSAGES: Sentences = {
    "not-installed": {
        "en": "{package} isn't installed, which reads the camera: {how}",
        "zh": "未安装读取摄像头所需的 {package}：{how}",
    },
    "no-camera": {
        "en": "No camera answers ({reason}). Is its cable in, and does no other program use it?",
        "zh": "没有摄像头响应（{reason}）。线插好了吗？有其他程序在使用它吗？",
    },
    "no-picture": {
        "en": "The camera gives no picture ({reason}). Check its cable, then reload.",
        "zh": "摄像头没有图像（{reason}）。请检查连接线，然后刷新。",
    },
    "no-answer": {
        "en": "The camera at {where:.80} gives no picture ({reason}). Is the car on, and is the address right?",
        "zh": "{where:.80} 处的摄像头没有图像（{reason}）。小车开机了吗？地址对吗？",
    },
    "too-many-viewers": {
        "en": "{most} watch this camera already, and more it can't serve. Close one of the pictures.",
        "zh": "已有 {most} 处在观看此摄像头，无法再增加。请关闭其中一个画面。",
    },
}


class CameraError(ToldError, OSError):
    """There is no picture."""

    SENTENCES = MESSAGES
