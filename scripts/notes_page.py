"""Make the documentation's page of all missions' notes for teachers, from the missions."""

from motorcade.locales import page_text
from motorcade.missions.document import missions
from motorcade.missions.model import Mission, Notes
from motorcade.missions.schema import PATHS
from motorcade.missions.watch import goal_phrase

_INTRODUCTIONS = {
    "en": "# Notes for teachers\n\nOne page for each mission: the aim, what to say first, usual mistakes and the hint "
    "that helps, a way to go on, and how many minutes a class needs. The studio prints each with its picture: "
    "Missions, then 'Notes for teachers'; a class's page links to them beside each mission that can be handed out.\n",
    "zh": "# 教师笔记\n\n每个任务一页：目标、先说什么、常见错误和对应的提示、接着做什么、需要多少分钟。"
    "工作室会把每一页连同图片打印出来：“任务”→“教师笔记”；班级页面上，每个可以分发的任务旁边都有链接。\n",
}


def notes_page(language: str) -> str:
    """Return the page in Markdown, in ``language`` (en or zh)."""
    parts = [_INTRODUCTIONS[language]]
    for path in PATHS:
        if noted := [(each, each.notes) for each in missions() if each.document["path"] == path and each.notes]:
            parts.append(f"## {page_text(('missions', 'paths', path), language)}\n")
            parts += [_notes(*each, language) for each in noted]
    return "\n".join(parts)


def _notes(mission: Mission, notes: Notes, language: str) -> str:

    def title(key: str) -> str:
        return page_text(("missions", "notes", key), language)

    minutes = title("minutes_other").replace("{{count}}", str(notes.minutes))
    goals = [
        f"{number}. {goal_phrase(goal, mission).sentence(language)} {'★' * goal.star}"
        for number, goal in enumerate(mission.goals, 1)
    ]
    mistakes = [
        f"- {text.sentence(language)}"
        + (f" *{title('helps').replace('{{hint}}', mission.hints[hint - 1].sentence(language))}*" if hint else "")
        for text, hint in notes.mistakes
    ]
    parts = [
        f"### {mission.name.sentence(language)} {{ #{mission.id} }}",
        f"![](pictures/missions/{mission.id}.webp)",
        f"`{mission.id}` · {minutes}",
        *(
            f"**{title(key)}** · {text.sentence(language)}"
            for key, text in (("aim", notes.aim), ("task", mission.story), ("say", notes.say))
        ),
        f"**{page_text(('missions', 'goals'), language)}**",
        "\n".join(goals),
        f"**{title('mistakes')}**",
        "\n".join(mistakes),
        f"**{title('learned')}** · {mission.learned.sentence(language)}",
        f"**{title('further')}** · {notes.further.sentence(language)}",
    ]
    return "\n\n".join(parts) + "\n"
