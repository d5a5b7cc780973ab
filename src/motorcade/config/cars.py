"""The list of cars that somebody writes, ``cars.toml``: lines of ``name = "port or address"``."""

from collections.abc import Iterable
from pathlib import Path

from motorcade.config.files import parse, read_text
from motorcade.errors import MotorcadeError


def read_cars(path: Path) -> dict[str, str]:
    """Return the ports and addresses by name. Raises MotorcadeError."""
    document = parse(read_text(path, str(path)), "TOML", str(path))
    names: dict[str, str] = {}
    for name, address in document.items():
        if not isinstance(address, str):
            raise MotorcadeError("car-list-value", file=path, name=name)
        if address in names:
            raise MotorcadeError("car-list-twice", file=path, address=address)
        names[address] = name
    return {name: address for address, name in names.items()}


def cars_text(cars: Iterable[tuple[str, str]]) -> str:
    """Return the text of such a list; ``cars`` are names, and ports or addresses."""
    quoted = ((name.replace("\\", "\\\\").replace('"', '\\"'), address) for name, address in cars)
    return "".join(f'"{name}" = "{address}"\n' for name, address in quoted)
