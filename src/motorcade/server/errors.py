"""What any server here may say to a request: stable codes, and their sentences in English and Chinese."""

from typing import Any, ClassVar

Messages = dict[str, dict[str, str]]

# The words in braces are filled in per case.
MESSAGES: Messages = {
    "bad-message": {
        "en": "The server doesn't understand this message: {reason}. Reload the page.",
        "zh": "服务器无法理解此消息：{reason}。请刷新页面。",
    },
    "too-deep": {
        "en": "The brackets of this message are nested too deeply. Use fewer blocks in a row.",
        "zh": "此消息的括号嵌套过深。请减少相连的积木。",
    },
    "body-too-large": {
        "en": "The page sent more than {most:,} bytes: make what it sends smaller.",
        "zh": "页面发送的内容超过 {most:,} 字节：请减少内容。",
    },
    "foreign-host": {
        "en": "This server isn't reached under the name {name}. Open the address that it printed when it started.",
        "zh": "不能用名称 {name} 访问此服务器。请打开它启动时显示的地址。",
    },
    "foreign-origin": {
        "en": "A page of another site asked for this, and only this server's own may.",
        "zh": "此请求来自其他网站的页面，只有此服务器自己的页面可以访问。",
    },
    "token-needed": {
        "en": "This server asks for its token. Open the whole address that it printed when it started.",
        "zh": "访问此服务器需要令牌。请打开它启动时显示的完整地址。",
    },
    "wrong-token": {
        "en": "This is not the token of this server. Open the whole address that it printed when it last started.",
        "zh": "令牌不正确。请打开此服务器最近一次启动时显示的完整地址。",
    },
    "too-many-requests": {
        "en": "Your computer asks more than {most} times a second. Wait a moment, then reload the page.",
        "zh": "您的电脑每秒请求超过 {most} 次。请稍候，然后刷新页面。",
    },
    "not-found": {
        "en": "There is nothing at this address.",
        "zh": "此地址没有内容。",
    },
    "bad-request": {
        "en": "The server can't answer this request: {reason}.",
        "zh": "服务器无法回答此请求：{reason}。",
    },
    "internal": {
        "en": "Something went wrong in the server itself. Save your work and start it again.",
        "zh": "服务器内部出错。请保存作品并重新启动。",
    },
    "too-many-messages": {
        "en": "The page says more than {most} things a second. Reload it.",
        "zh": "页面每秒发送的消息超过 {most} 条。请刷新页面。",
    },
    "message-too-long": {
        "en": "The page sent more than {most:,} bytes at once: make the mat or the program smaller.",
        "zh": "页面一次发送的内容超过 {most:,} 字节：请缩小场地或程序。",
    },
}


class ServerError(Exception):
    """Something that was asked for and can't be had.

    Attributes:
        code: a key of ``messages``; stable.
        status: the HTTP status that says it.

    What fills a sentence's braces may differ by language: a dict then holds one text for each.
    """

    messages: ClassVar[Messages] = MESSAGES

    def __init__(self, code: str, status: int = 400, **arguments: Any):
        self.code = code
        self.status = status
        self._arguments = arguments
        super().__init__(self.message("en"))

    def message(self, language: str) -> str:
        """The sentence in ``language`` (en or zh)."""
        arguments = {
            name: value[language] if isinstance(value, dict) else value for name, value in self._arguments.items()
        }
        return self.messages[self.code][language].format(**arguments)

    def as_dict(self) -> dict[str, Any]:
        """``{"code", "message": {"en", "zh"}}``."""
        return {
            "code": self.code,
            "message": {language: self.message(language) for language in self.messages[self.code]},
        }
