"""A Wireshark dissector in Lua for words on TCP connections and for captured images.

Only its table of fields is generated; the code that uses the table is in `templates/wireshark.lua`.
"""

from motorcade.config.vocabulary import Vocabulary, fingerprint_text
from motorcade.export.templates import filled_template
from motorcade.words.field import Field, WordFormat

# The TCP port on which a car listens for drive commands by default.
DRIVE_PORT = 5005
_STREAMS = {"drive": DRIVE_PORT}
_USE_OWN = """\
-- Words of the format {name} on a TCP connection: -d tcp.port==6000,motorcade_{name}"""
_USE = f"""\
-- Drive commands are found on TCP port {DRIVE_PORT}, captured images in packets of link type USER0 (147), and
-- uploads over TCP where you say so: -d tcp.port==7000,motorcade_image"""


def wireshark(vocabulary: Vocabulary) -> str:
    """Return the text of the dissector."""
    parts_of_images = ("header", "control") if vocabulary.has_images else ()
    names = [word_format.name for word_format in vocabulary.formats]
    streams = [name for name in names if name not in parts_of_images]
    return filled_template(
        "wireshark.lua",
        NAMES=", ".join(names),
        FILE=f"{vocabulary.file_stem}.lua",
        USE=_USE if vocabulary.has_images else _USE_OWN.format(name=names[0]),
        FORMATS="\n".join(_format(word_format) for word_format in vocabulary.formats),
        STREAMS=", ".join(f'{{ name = "{name}", port = {_STREAMS.get(name, 0)} }}' for name in streams),
        HAS_IMAGES=_lua(vocabulary.has_images),
    )


def _format(word_format: WordFormat) -> str:
    fields = "\n".join(f"      {_field(field)}," for field in word_format.fields)
    title = _lua(f"{word_format.name} word")
    fingerprint = _lua(fingerprint_text(word_format))
    return f"""\
  {word_format.name} = {{
    title = {title},
    fingerprint = {fingerprint},
    fields = {{
{fields}
    }},
  }},"""


def _field(field: Field) -> str:
    entries: dict[str, str | int | bool] = {
        "name": field.name,
        "high": field.high,
        "low": field.low,
        "minimum": field.minimum,
        "maximum": field.maximum,
        "meaning": field.meaning,
        "allowed": str(field.allowed),
    }
    entries |= {key: True for key in ("one_hot", "reserved") if getattr(field, key)}
    entries |= {key: getattr(field, key) for key in ("needs", "unit") if getattr(field, key)}
    if field.reserved:
        entries |= {"defined": field.defined, "reserved_allowed": str(field.reserved_allowed)}
    if field.goes_with:
        entries["goes_with"] = field.goes_with
        entries["allowed_beside_0"] = str(field.allowed_beside(0))
        entries["allowed_beside_others"] = str(field.allowed_beside(1))
    parts = [f"{key} = {_lua(value)}" for key, value in entries.items()]
    if field.only:
        names = ", ".join(f"[{raw}] = {_lua(name)}" for raw, name in field.only)
        parts.append(f"only = {{ {names} }}")
    return "{ " + ", ".join(parts) + " }"


def _lua(value: str | int | bool) -> str:
    """Write ``value`` in Lua. Texts are printable, so only quotes and backslashes are escaped."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
