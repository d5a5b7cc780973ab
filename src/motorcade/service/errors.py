"""What can go wrong in the studio: stable codes, and their sentences in English and Chinese."""

from motorcade.errors import MotorcadeError
from motorcade.program.diagnostics import LANGUAGES
from motorcade.server.errors import MESSAGES as SERVER_MESSAGES
from motorcade.server.errors import ServerError

# The words in braces are filled in per case.
MESSAGES: dict[str, dict[str, str]] = {
    "bad-name": {
        "en": "A project's name has 1 to {most} characters, no slash and no line break. Choose another name.",
        "zh": "项目名称应为 1 到 {most} 个字符，不能含斜杠或换行。请换一个名称。",
    },
    "no-project": {
        "en": "There is no project '{name}' in the library.",
        "zh": "项目库中没有“{name}”。",
    },
    "no-version": {
        "en": "The project '{name}' has no version {version}.",
        "zh": "项目“{name}”没有第 {version} 版。",
    },
    "damaged-version": {
        "en": "This version of '{name}' is damaged. Open an earlier one.",
        "zh": "“{name}”的这个版本已损坏。请打开更早的版本。",
    },
    "cant-save": {
        "en": "The project can't be saved in the library: {reason}. Save it as a file.",
        "zh": "无法将项目保存到项目库：{reason}。请另存为文件。",
    },
    "cant-read": {
        "en": "The project can't be read: {reason}.",
        "zh": "无法读取项目：{reason}。",
    },
    "cant-delete": {
        "en": "The project can't be deleted: {reason}.",
        "zh": "无法删除项目：{reason}。",
    },
    "no-example": {
        "en": "There is no example '{name}'.",
        "zh": "没有名为“{name}”的示例。",
    },
    "unknown-profile": {
        "en": "There is no kind of car called '{name}'. Known: {known}.",
        "zh": "没有名为“{name}”的车型。已有：{known}。",
    },
    "image-cut-off": {
        "en": "The image is cut off: words are missing at its end. Read the car once more.",
        "zh": "映像不完整：末尾缺少码字。请重新读取小车。",
    },
    "image-too-long": {
        "en": "The image is longer than its header says. Read the car once more.",
        "zh": "映像比头位串所说的更长。请重新读取小车。",
    },
    "image-header": {
        "en": "The image's first word is no header. Is this the file of a car's program?",
        "zh": "映像的第一个码字不是头位串。这是小车程序的文件吗？",
    },
    "image-word": {
        "en": "The image holds a word that no car understands. Is this the file of a car's program?",
        "zh": "映像中有小车无法识别的码字。这是小车程序的文件吗？",
    },
    "not-decompiled": {
        "en": "No blocks say what this image does: {reason}.",
        "zh": "没有积木能表示此映像的内容：{reason}。",
    },
    "bad-mat": {
        "en": "The mat can't be used: {reason}.",
        "zh": "无法使用该场地：{reason}。",
    },
    "too-many-cars": {
        "en": "The mat has {count:,.0f} cars, and {most:,} is the most here. Take some away.",
        "zh": "场地上有 {count:,.0f} 辆小车，这里最多 {most:,} 辆。请减少一些。",
    },
    "too-much-furniture": {
        "en": "The mat has {count:,} walls, obstacles, corners, steps and voices, and {most:,} is the most here. "
        "Take some away.",
        "zh": "场地上的墙、障碍物、拐角、路径点和声音共有 {count:,} 个，这里最多 {most:,} 个。请减少一些。",
    },
    "bad-world": {
        "en": "The cars can't drive there: {reason}.",
        "zh": "小车无法在此行驶：{reason}。",
    },
    "bad-session": {
        "en": "The page has no proper session number. Reload it.",
        "zh": "页面的会话编号无效。请刷新页面。",
    },
    "no-world": {
        "en": "There is no world here yet, or no longer. Reload the page.",
        "zh": "这里还没有场景，或场景已不存在。请刷新页面。",
    },
    "too-many-sessions": {
        "en": "The studio is full: {most} pages are open. Close one, or try again in a minute.",
        "zh": "工作室已满：已打开 {most} 个页面。请关闭一个，或一分钟后再试。",
    },
    "taken-over": {
        "en": "These cars are shown in another tab now. Reload this page to bring them back here.",
        "zh": "这些小车现在显示在另一个标签页中。刷新本页即可在此继续。",
    },
    "nothing-to-draw": {
        "en": "Nothing has happened yet that could be drawn: let the cars drive first.",
        "zh": "还没有可绘制的内容：请先让小车行驶。",
    },
    "film-failed": {
        "en": "The film can't be drawn: {reason}.",
        "zh": "无法生成动画：{reason}。",
    },
    "virtual-car": {
        "en": "The virtual car can't wake up. Delete the file {path}, in which it keeps its program, and try again.",
        "zh": "虚拟小车无法启动。请删除它保存程序的文件 {path}，然后重试。",
    },
    # In place of the sentences of `motorcade.program.diagnostics` that name a place in a file: the page leads there.
    "too-many-states": {
        "en": "The serial modules in use are more than 255: they make {count} states. "
        "The block that costs most makes {cost} of them: shorten it or repeat it less often.",
        "zh": "所用的串行模块数目已经大于255：共 {count} 个状态。"
        "占用最多的积木有 {cost} 个状态：请缩短它或减少重复次数。",
    },
    "too-many-words": {
        "en": "The followers' program needs {count} words, and 255 is the most. "
        "The block that costs most needs {cost} of them: shorten it or repeat it less often.",
        "zh": "从机程序需要 {count} 个码字，最多为 255 个。占用最多的积木有 {cost} 个码字：请缩短它或减少重复次数。",
    },
}


def reason_of(problem: MotorcadeError) -> dict[str, str]:
    """What is wrong in each language, as the end of a sentence of the studio's."""
    return {language: problem.sentence(language) for language in LANGUAGES}


class StudioError(ServerError):
    """Something that the page asked for and can't have; ``code`` is a key of MESSAGES or one of every server's."""

    messages = SERVER_MESSAGES | MESSAGES
