"""Cars from shops: for each a pin file in `firmware/cars`, and a profile of the same name."""

from typing import Any

from motorcade.config.pins import PARTS, PinMap, load_pins
from motorcade.errors import InputError
from motorcade.firmware import firmware_folder

# What a car can do with a part, or with a wire of one: the ending of the phrase that says it.
_ABILITIES = {
    "leads": "infrared.sender",
    "follows": "infrared.receiver",
    "obstacles": "ultrasonic",
    "lines": "floor",
    "people": "pir",
}


def shop_cars() -> list[str]:
    """Return the names of all cars, in the order of the alphabet."""
    return sorted(file.stem for file in firmware_folder("cars").glob("*.toml"))


def shop_name(text: str) -> str:
    """Return a car's name, however its letters are written. Raises MotorcadeError no-such-shop-car, which lists all."""
    name = text.lower()
    if name not in shop_cars():
        raise InputError("no-such-shop-car", name=text[:40], known=", ".join(shop_cars()))
    return name


def shop_car(name: str) -> PinMap:
    """Return the pins of the car called ``name``. Raises MotorcadeError, as shop_name does."""
    return load_pins(firmware_folder("cars") / f"{shop_name(name)}.toml")


def abilities(pins: PinMap) -> list[str]:
    """Return what a car with these pins can do: some of leads, follows, obstacles, lines and people."""
    wired = {wire.device.key for wire in pins.wires} | {f"{wire.device.key}.{wire.role.key}" for wire in pins.wires}
    return [ability for ability, part in _ABILITIES.items() if part in wired]


def described(name: str) -> dict[str, Any]:
    """Return what is known of a car: name, title, chip, what it can do, and the parts that no source confirms."""
    pins = shop_car(name)
    unconfirmed = [part.key for part in PARTS if pins.has(part.key) and part.key not in pins.sources]
    can = abilities(pins)
    return {"name": name, "title": pins.name, "chip": pins.chip.title, "can": can, "unconfirmed": unconfirmed}
