"""What makes each generated file, but for the sources that `scripts.generate` writes before all else."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from scripts.arbiter_diagram import arbiter_svg
from scripts.arduino_files import arduino_files
from scripts.clips import block_clips, example_clips
from scripts.driving_types import driving_types
from scripts.exports import exported_files
from scripts.goal_kinds import goal_kinds
from scripts.message_types import class_types, message_types, remote_types
from scripts.opening_recording import opening_recording
from scripts.step_files import step_types, with_step_names, with_steps_table
from scripts.wiring_pages import wiring_files
from scripts.world_types import world_types

from motorcade.config.check import published
from motorcade.mats.schema import mat_schema
from motorcade.missions.schema import mission_schema
from motorcade.program.schema import program_schema

ROOT = Path(__file__).resolve().parent.parent


def _exports() -> dict[str, Callable[[], str]]:
    """Return what makes each file of `motorcade export`, by its path in the repository."""
    made: dict[str, Callable[[], str]] = {}
    for name, text in exported_files().items():
        folder = "firmware/arduino/src/" if "brain" in name else "src/motorcade/export/"
        made[folder + name] = partial(str, text)
    return made


GENERATED = {
    "docs/drive-states.svg": lambda: arbiter_svg("en"),
    "docs/drive-states.zh.svg": lambda: arbiter_svg("zh"),
    "docs/motorcade-mat-1.schema.json": lambda: _json(published(mat_schema())),
    "docs/motorcade-mission-1.schema.json": lambda: _json(published(mission_schema())),
    "docs/motorcade-program-1.schema.json": lambda: _json(published(program_schema())),
    "docs/api.md": lambda: with_step_names(_text("docs/api.md")),
    "docs/api.zh.md": lambda: with_step_names(_text("docs/api.zh.md")),
    "docs/programs.md": lambda: with_steps_table(_text("docs/programs.md"), "en"),
    "docs/programs.zh.md": lambda: with_steps_table(_text("docs/programs.zh.md"), "zh"),
    "src/motorcade/browser/opening.json": opening_recording,
    "web/src/generated/classroom.ts": class_types,
    "web/src/generated/blockClips.json": block_clips,
    "web/src/generated/clips.json": example_clips,
    "web/src/generated/driving.ts": driving_types,
    "web/src/generated/goals.ts": goal_kinds,
    "web/src/generated/messages.ts": message_types,
    "web/src/generated/remote.ts": remote_types,
    "web/src/generated/steps.ts": step_types,
    "web/src/generated/world.ts": world_types,
    **wiring_files(),
    **arduino_files(),
    **_exports(),
}


def _text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def _json(schema: dict[str, Any]) -> str:
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
