"""A Wireshark dissector in Lua for words on TCP connections and for captured images.

Only its table of fields is generated; the code that uses the table is in `templates/wireshark.lua`.
"""

from collections.abc import Iterator

from motorcade.errors import Phrase
from motorcade.words import request
from motorcade.words.field import WORD_BITS, Field, WordFormat
from motorcade.words.flow import DECIDES
from motorcade.words.formats import DRIVE, FORMATS, FRAME, SWITCHES
from motorcade.words.receiver import READBACK_HEADER
from motorcade.words.request import ASK, BLINK, GO, NAME, STOP

from .fields import FILE_STEM, fingerprint_text
from .templates import filled_template

# The TCP port on which a car listens for drive commands by default.
DRIVE_PORT = 5005
# What a request asks, by its kind.
_KINDS = {ASK: "who are you", BLINK: "blink", NAME: "take a name", STOP: "stop", GO: "go"}
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
        STREAMS="\n".join(_streams()),
        BAD=", ".join(_bad()),
        **_requests(),
    )


def _bad() -> Iterator[str]:
    """Yield the sentences about computed fields, with places for the values that Lua fills."""
    for field in (field for word_format in FORMATS for field in word_format.fields if field.parity_masks):
        yield f"{field.name} = {_lua(str(Phrase(f'bad-{field.name}', value='%d', expected='%d')))}"
    yield f"reserved = {_lua(str(Phrase('bad-reserved', field='%s', value='%d', needs='%s')))}"


def _streams() -> Iterator[str]:
    """Yield the streams of words. All drive commands go to one port, and the user link type 1 holds captured frames."""
    formats = [DRIVE]
    for switch in SWITCHES:
        if switch.word_format not in formats:
            formats.append(switch.word_format)
    names = ", ".join(_lua(word_format.name) for word_format in formats)
    codes = tuple(code for word_format in formats for code in word_format.field("code").only)
    allowed = _lua(str(Field("code", 31, 28, "", only=codes).allowed))
    yield f'  {{ name = "{DRIVE.name}", formats = {{ {names} }}, codes = {allowed}, port = {DRIVE_PORT} }},'
    yield f'  {{ name = "{FRAME.name}", formats = {{ "{FRAME.name}" }}, port = 0, user_link = 1 }},'


def _requests() -> dict[str, str]:
    """Return where the parts of requests are, and what their kinds mean."""
    numbers = {
        "READBACK_REQUEST": READBACK_HEADER,
        "DECIDES": DECIDES,
        "CHECK_HEADER": request.CHECK_HEADER,
        "CHECK_BYTES": request.CHECK_BYTES,
        "CHECK_MARKS": request.MARKS,
        "CHECK_BYTE_AT": request.PAYLOAD_AT,
        "REQUEST_HEADER": request.REQUEST_HEADER,
        "REQUEST_BYTES": request.REQUEST_BYTES,
        "KIND_AT": request.KIND_AT,
        "NAME_AT": request.SUM_AT - request.NAME_BYTES,
        "SUM_AT": request.SUM_AT,
    }
    kinds = ", ".join(f"{kind} = {_lua(meaning)}" for kind, meaning in _KINDS.items())
    return {name: str(number) for name, number in numbers.items()} | {"KINDS": kinds}


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
