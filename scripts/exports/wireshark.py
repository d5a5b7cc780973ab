"""A Wireshark dissector in Lua for words on TCP connections and for captured images.

Only its table of fields is generated; the code that uses the table is in `templates/wireshark.lua`.
"""

from collections.abc import Iterator

from motorcade.errors import Phrase
from motorcade.words.field import WORD_BITS, Field, WordFormat
from motorcade.words.formats import FORMATS

from .fields import FILE_STEM, fingerprint_text
from .templates import filled_template

# The TCP port on which a car listens for drive commands by default.
DRIVE_PORT = 5005
_STREAMS = {"drive": DRIVE_PORT}
# The user link type of captured packets that hold words, one behind the other.
_USER_LINKS = {"frame": 1}
_PARTS_OF_IMAGES = ("header", "control")
_USE = f"""\
-- Drive commands are found on TCP port {DRIVE_PORT}, captured images in packets of link type USER0 (147), infrared
-- frames in packets of link type USER1 (148), and uploads or frames over TCP where you say so:
-- -d tcp.port==7000,motorcade_image or -d tcp.port==7000,motorcade_frame"""


def wireshark() -> str:
    """Return the text of the dissector."""
    return filled_template(
        "wireshark.lua",
        NAMES=", ".join(word_format.name for word_format in FORMATS),
        FILE=f"{FILE_STEM}.lua",
        USE=_USE,
        FORMATS="\n".join(_format(word_format) for word_format in FORMATS),
        STREAMS=", ".join(_stream(each.name) for each in FORMATS if each.name not in _PARTS_OF_IMAGES),
        BAD=", ".join(_bad()),
    )


def _bad() -> Iterator[str]:
    """Yield the sentences about computed fields, with places for the values that Lua fills."""
    for field in (field for word_format in FORMATS for field in word_format.fields if field.parity_masks):
        yield f"{field.name} = {_lua(str(Phrase(f'bad-{field.name}', value='%d', expected='%d')))}"
    yield f"reserved = {_lua(str(Phrase('bad-reserved', field='%s', value='%d', needs='%s')))}"


def _stream(name: str) -> str:
    link = f", user_link = {_USER_LINKS[name]}" if name in _USER_LINKS else ""
    return f'{{ name = "{name}", port = {_STREAMS.get(name, 0)}{link} }}'


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
    if field.parity_masks:
        bits = (", ".join(str(bit) for bit in range(WORD_BITS) if mask >> bit & 1) for mask in field.parity_masks)
        parts.append("parities = { " + ", ".join(f"{{ {each} }}" for each in bits) + " }")
    return "{ " + ", ".join(parts) + " }"


def _lua(value: str | int | bool) -> str:
    """Write ``value`` in Lua. Texts are printable, so only quotes and backslashes are escaped."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
