"""Make the documentation's page of all commands from the help of the command line."""

import typer
from typer.cli import get_docs_for_click

from motorcade.cli import command_line, translate_help
from motorcade.cli.output import request_language, translated

# Typer writes them in English.
_TITLES = ("Usage", "Arguments", "Options", "Commands")

_INTRODUCTIONS = {
    "en": "# Commands\n\nEvery command also says this with `--help`.\n",
    "zh": "# 命令\n\n每条命令都可用 `--help` 显示这些内容。\n",
}


def commands_page(language: str) -> str:
    """Return the page in Markdown, in ``language`` (en or zh)."""
    command = command_line()
    request_language(language)
    translate_help(command)
    titles = {name: translated(f"help-{name.lower()}").rstrip(": ：") for name in _TITLES}
    request_language("")
    context = typer.Context(command, info_name="motorcade")
    page = get_docs_for_click(obj=command, ctx=context, name="motorcade")
    # These lines show the arguments of a command: a console block would make them look like lines to type.
    page = page.replace("```console\n$ ", "```text\n").replace("# `motorcade`\n", "## `motorcade`\n", 1)
    for name, title in titles.items():
        page = page.replace(f"**{name}**:", f"**{title}**:")
    return f"{_INTRODUCTIONS[language]}\n{page.strip()}\n"
