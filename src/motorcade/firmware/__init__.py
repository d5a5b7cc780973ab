"""What is put on a microcontroller, and how; and cars from shops."""

from pathlib import Path


def firmware_folder(name: str) -> Path:
    """Return a folder of `firmware/`: in the package, or beside the sources of a clone."""
    packaged = Path(__file__).with_name(name)
    if packaged.is_dir():
        return packaged
    return Path(__file__).parents[3] / "firmware" / name
