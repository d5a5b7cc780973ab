"""The words, and the brain of a car, for other tools: files that `make generate` wrote."""

from importlib import resources

from motorcade.errors import MotorcadeError
from motorcade.firmware.arduino_library import library_folder

TARGETS = {
    "c": ("motorcade_words.h",),
    "brain-c": ("motorcade_brain.h", "motorcade_brain.c"),
    "wireshark": ("motorcade_words.lua",),
    "json-schema": ("motorcade_words.schema.json",),
    "vectors": ("motorcade_words.vectors.json",),
}


def export(target: str) -> dict[str, bytes]:
    """Return the files of a target, by name. Raises MotorcadeError: unknown-target."""
    if target not in TARGETS:
        raise MotorcadeError("unknown-target", target=target[:40], targets=", ".join(TARGETS))
    # The brain is a part of the Arduino library, whose sources must be in one folder.
    folder = library_folder() / "src" if target == "brain-c" else resources.files(__package__)
    return {name: (folder / name).read_bytes() for name in TARGETS[target]}
