"""What is wrong with an image, in Chinese too; apart, since no microcontroller needs to say it."""

from motorcade.words.image import ImageError

# By code, and by which figures there are.
_CHINESE = (
    ("cut-off", "count", "{count} 个字节不是整数个 4 字节码字"),
    ("cut-off", "expected", "映像不完整：头位串说明有 {expected} 个码字，这里只有 {here} 个"),
    ("cut-off", "", "映像是空的：连头位串都没有"),
    ("too-long", "expected", "映像过长：头位串说明有 {expected} 个码字，这里有 {here} 个"),
    ("header", "field", "头位串 0x{word:08X} 无效：{field} 的值不能是 {value}"),
    ("word", "field", "第 {position} 个码字（0x{word:08X}）无效：{field} 的值不能是 {value}"),
    ("program", "place", "{place} 不是程序：{reason}"),
    ("project", "file", "{file} 不是映像。如果它是项目文件，请先编译"),
)


def image_sentence(problem: ImageError, language: str) -> str:
    """What is wrong, in ``language`` (en or zh)."""
    if language == "zh":
        for code, figure, template in _CHINESE:
            if problem.code == code and (not figure or figure in problem.figures):
                return template.format(**problem.figures)
    return str(problem)
