"""Make the files that `motorcade export` gives, from the declared formats and the source of the brain."""

from .brain_c import brain_c
from .c_header import c_header
from .fields import FILE_STEM
from .markdown import markdown
from .schemas import json_schema
from .vectors import vectors
from .wireshark import wireshark

__all__ = ["exported_files", "markdown"]


def exported_files() -> dict[str, str]:
    """Return the text of each file by its name; the same bytes on every machine."""
    return {
        f"{FILE_STEM}.h": c_header(),
        **brain_c(),
        f"{FILE_STEM}.lua": wireshark(),
        f"{FILE_STEM}.schema.json": json_schema(),
        f"{FILE_STEM}.vectors.json": vectors(),
    }
