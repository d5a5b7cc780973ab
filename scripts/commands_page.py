"""The documentation's page of all commands, from the command line's own help."""

import typer
from typer.cli import get_docs_for_click

from motorcade.cli import app

_INTRODUCTIONS = {
    "en": "# Commands\n\nEvery command also says this with `--help`.\n",
    "zh": "# 命令\n\n每条命令都可用 `--help` 显示这些内容（英文）。\n",
}


def commands_page(language: str) -> str:
    """The page in Markdown; its introduction in ``language``, en or zh."""
    command = typer.main.get_command(app)
    context = typer.Context(command, info_name="motorcade")
    told = get_docs_for_click(obj=command, ctx=context, name="motorcade")
    # How a command is written is nothing to type as it stands.
    told = told.replace("```console\n$ ", "```text\n").replace("# `motorcade`\n", "## `motorcade`\n", 1)
    return f"{_INTRODUCTIONS[language]}\n{told.strip()}\n"
