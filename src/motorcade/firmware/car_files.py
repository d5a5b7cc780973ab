"""The files that a board with MicroPython gets: what its main.py needs, directly or through others, and its settings.

The settings are the contents of a pin file, a profile and a voice map as JSON, since MicroPython reads no TOML.
`motorcade.boards.on_chip.power_on` reads them on the board.
"""

import ast
import json
from importlib import import_module
from pathlib import Path
from typing import Any

from motorcade.boards.on_chip.power_on import SETTINGS_FILE, SETTINGS_FORMAT
from motorcade.config.pins import INPUTS, PinMap, VoiceMap
from motorcade.config.profile import Profile, levels_of
from motorcade.errors import MotorcadeError

MAIN = "main.py"
# Which chip's pin files each chip takes: a Pico 2 has the pins of a Pico.
PIN_FILES = {"esp32": "esp32", "rp2040": "rp2040", "rp2350": "rp2040"}
_ESP32_UARTS = {"serial": 1, "voice": 2}
# An ESP32's second UART sends on this pin, even if it is set up only to receive.
_ESP32_VOICE_SENDS_AT = 17
# The folder that MicroPython searches for modules.
LIBRARY = "lib"
_PACKAGE = "motorcade"
_SOURCE = Path(__file__).parents[1]
# The checker of boards is for those who change a board and try it at the prompt.
_EXTRAS = ("motorcade.car.check",)
# Sentences and exit codes stay on the computer: on a board an error is its code and details.
_NOT_COPIED = ("motorcade.locales", "motorcade.outcomes")
_WORDS = "motorcade.words."
_FORMATS = "motorcade.words.formats"


def templates() -> Path:
    """Return the folder of main.py and of the pin files: in the package, or beside the sources of a clone."""
    packaged = Path(__file__).with_name("micropython")
    return packaged if packaged.is_dir() else _SOURCE.parents[1] / "firmware" / "micropython"


def board_files(settings: dict[str, Any]) -> dict[str, bytes]:
    """Return each file's path on the board and its bytes; main.py is the last, since nothing starts without it."""
    main = (templates() / MAIN).read_bytes()
    modules = _Modules()
    for statement in ast.parse(main).body:
        modules.follow(statement)
    for name in _EXTRAS:
        modules.add(name)
    files = {f"{LIBRARY}/{path}": source for path, source in sorted(modules.files().items())}
    files[SETTINGS_FILE] = json.dumps(settings).encode()
    files[MAIN] = main
    return files


def settings_of(
    pins: PinMap, profile: Profile, is_leader: bool, number: int | None = None, voice: VoiceMap | None = None
) -> dict[str, Any]:
    """Return the settings of one car.

    Args:
        pins: which part is at which pin.
        profile: the car's kind.
        is_leader: whether the car leads or follows.
        number: 0 to 2^32 - 1; None for one that the board makes from its chip's number.
        voice: the bytes that the voice module sends; needed where the pin file has one.

    Raises:
        MotorcadeError: no MicroPython car can be wired like this.
    """
    if pins.chip.name not in PIN_FILES.values():
        known = " / ".join(sorted(set(PIN_FILES.values())))
        raise MotorcadeError("no-micropython-for-chip", car=pins.name, known=known, chip=pins.chip.title)
    settings: dict[str, Any] = {
        "format": SETTINGS_FORMAT,
        "name": pins.name,
        "is_leader": is_leader,
        "number": number,
        "levels": list(levels_of(profile)),
        "range_mm": profile.body.ultrasonic_range_mm,
        "baud": profile.serial.baud,
        "drive_duties": list(pins.drive_duties),
        "turn_duties": list(pins.turn_duties),
        "pins": _pins(pins),
        # A dict loses its order on a board; the order of pins is that of the bits.
        "inputs": {
            part.key: [wire.pin for wire in pins.wires if wire.device is part] for part in INPUTS if pins.has(part.key)
        },
        "uarts": {device: _uart(pins, device) for device in ("serial", "voice") if pins.has(device)},
    }
    if pins.has("voice"):
        if voice is None:
            raise MotorcadeError("no-voice-map", car=pins.name)
        settings["voice"] = {
            "baud": voice.baud,
            "patterns": [[pattern.hex(), word] for pattern, word in voice.patterns],
        }
    return settings


class _Modules:
    """The modules that a board needs: of `motorcade.words` only what the others use, which saves a third of its memory.

    The car uses the formats for the positions of fields alone, so these become integers.
    """

    def __init__(self) -> None:
        self._trees: dict[str, ast.Module] = {}
        self._used: dict[str, set[str]] = {}
        self._positions: set[ast.stmt] = set()

    def add(self, module: str) -> bool:
        """Add a module, its package and what it imports; return whether there is such a module."""
        if module in self._trees:
            return True
        path = _path_of(module)
        if not path.is_file() or module.startswith(_NOT_COPIED):
            return False
        # Motorcade's own __init__ needs CPython's importlib.
        self._trees[module] = ast.parse(b"" if module == _PACKAGE else path.read_bytes())
        self._used[module] = set()
        self._positions |= _make_positions(self._trees[module], module)
        if package := module.rpartition(".")[0]:
            self.add(package)
        for statement in self._trees[module].body:
            if not _defined(statement):
                self.follow(statement, module)
        if not module.startswith(_WORDS):
            self._use_all(module)
        return True

    def follow(self, statement: ast.stmt, module: str = "") -> None:
        """Add what ``statement`` of ``module`` imports and, of its own module, names."""
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and module:
                self._use(module, node.id)
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    self._import(str(node.module), alias.name)

    def files(self) -> dict[str, bytes]:
        """Return each module's path below `LIBRARY` and its source."""
        return {
            f"{_PACKAGE}/{_path_of(module).relative_to(_SOURCE).as_posix()}": self._source(module)
            for module in self._trees
        }

    def _import(self, module: str, name: str) -> None:
        if module.split(".")[0] != _PACKAGE or not self.add(module):
            return
        if self.add(f"{module}.{name}"):
            self._use_all(f"{module}.{name}")
        else:
            self._use(module, name)

    def _use_all(self, module: str) -> None:
        for statement in self._trees[module].body:
            if not str(getattr(statement, "module", "")).startswith(_WORDS):
                for name in _defined(statement):
                    self._use(module, name)

    def _use(self, module: str, name: str) -> None:
        if name in self._used[module]:
            return
        self._used[module].add(name)
        for statement in self._trees[module].body:
            if name in _defined(statement):
                if isinstance(statement, ast.ImportFrom):
                    self._import(str(statement.module), name)
                else:
                    self.follow(statement, module)

    def _source(self, module: str) -> bytes:
        if module == _PACKAGE:
            return b""
        lines = _path_of(module).read_text(encoding="utf-8").splitlines(keepends=True)
        for statement in reversed(self._trees[module].body):
            defined = _defined(statement)
            used = [name for name in defined if name in self._used[module]]
            if used == defined and statement not in self._positions:
                continue
            if isinstance(statement, ast.ImportFrom):
                statement.names = [alias for alias in statement.names if alias.name in used]
            first = min([statement.lineno, *(each.lineno for each in getattr(statement, "decorator_list", []))])
            lines[first - 1 : statement.end_lineno] = [ast.unparse(statement) + "\n"] if used else []
        return "".join(lines).encode()


def _path_of(module: str) -> Path:
    path = _SOURCE.joinpath(*module.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _make_positions(tree: ast.Module, module: str) -> set[ast.stmt]:
    """Turn each value that comes from the formats into its integer; return those statements."""
    formats = {
        alias.name
        for statement in tree.body
        if isinstance(statement, ast.ImportFrom) and statement.module == _FORMATS
        for alias in statement.names
    }
    made: set[ast.stmt] = set()
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and formats & {
            node.id for node in ast.walk(statement.value) if isinstance(node, ast.Name)
        }:
            value = getattr(import_module(module), _defined(statement)[0])
            statement.value = ast.Constant(int(value))
            made.add(statement)
    return made


def _defined(statement: ast.stmt) -> list[str]:
    """Return the names that a module gets by ``statement``."""
    if isinstance(statement, (ast.FunctionDef, ast.ClassDef)):
        return [statement.name]
    if isinstance(statement, ast.ImportFrom):
        return [alias.name for alias in statement.names]
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
    return [node.id for target in targets if target for node in ast.walk(target) if isinstance(node, ast.Name)]


def _pins(pins: PinMap) -> dict[str, dict[str, int]]:
    devices: dict[str, dict[str, int]] = {}
    for wire in pins.wires:
        devices.setdefault(wire.device.key, {})[wire.role.key] = wire.pin
    return devices


def _uart(pins: PinMap, device: str) -> int:
    """Return which UART the device's pins lead to. Raises MotorcadeError where there is none or it is in use."""
    wires = {wire.role.key: wire.pin for wire in pins.wires if wire.device.key == device}
    if pins.chip.name == "esp32":
        others = [wire.pin for wire in pins.wires if wire.device.key != "voice"]
        if device == "voice" and _ESP32_VOICE_SENDS_AT in others:
            raise MotorcadeError("pin-of-voice-uart", car=pins.name, pin=_ESP32_VOICE_SENDS_AT)
        return _ESP32_UARTS[device]
    uarts = set()
    for role, pin in wires.items():
        # GP0 sends and GP1 receives for UART 0, GP4 and GP5 for UART 1, and so on in this order: 0 1 1 0 0 1 1.
        if pin % 4 != ("transmit", "receive").index(role):
            raise MotorcadeError("pin-without-uart", car=pins.name, wire=f"{device}.{role}", value=pin)
        uarts.add((pin + 4) // 8 % 2)
    if len(uarts) != 1:
        raise MotorcadeError("pins-of-two-uarts", car=pins.name, device=device)
    uart = uarts.pop()
    if device == "voice" and pins.has("serial") and _uart(pins, "serial") == uart:
        raise MotorcadeError("uart-takes-uploads", car=pins.name)
    return uart
