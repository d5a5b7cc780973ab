"""The image in the flash: the new one or the old one, whole, after any cut of power and in a full flash."""

import pytest
from hypothesis import given
from simulated.flash import Flash, PowerCut

from motorcade.boards.on_chip.image_file import ImageFile
from support.chip_benches import SMALL
from support.strategies import images

LARGE = bytes.fromhex("FFFF0100" + "64800000" * 255 + "C0280000" * 255)
MIDDLE = bytes.fromhex("20080200" + "64800000" * 32 + "C0280000" * 8)
EMPTY = bytes(4)


def cuts(flash: Flash, old: bytes | None, new: bytes):
    """Return what is found after each cut of power while ``new`` replaces ``old``."""
    for steps in range(len(new) + 100):
        flash.files.clear()
        flash.cut_after = None
        store = ImageFile("car.image", flash, flash.open)
        if old is not None:
            store.save(old)
        flash.cut_after = steps
        try:
            store.save(new)
        except PowerCut:
            flash.cut_after = None
            yield store.load()
        else:
            flash.cut_after = None
            assert store.load() == new
            return
    raise AssertionError("the power was never enough")


PAIRS = [(SMALL, MIDDLE), (MIDDLE, SMALL), (EMPTY, SMALL), (None, SMALL), (MIDDLE, MIDDLE[:-4] + EMPTY), (SMALL, LARGE)]


@pytest.mark.parametrize("atomic_rename", [True, False], ids=["littlefs", "FAT"])
@pytest.mark.parametrize(("old", "new"), PAIRS, ids=lambda image: f"{len(image or b'')} bytes")
def test_a_cut_of_power_at_any_byte_leaves_the_old_image_or_the_new_one(atomic_rename, old, new):
    found = list(cuts(Flash(atomic_rename), old, new))
    assert len(found) > len(new)
    assert set(found) <= {old, new}
    assert found[0] == old


def test_after_a_cut_the_next_image_is_stored():
    flash = Flash()
    for _ in cuts(flash, SMALL, LARGE):
        ImageFile("car.image", flash, flash.open).save(LARGE)
        assert ImageFile("car.image", flash, flash.open).load() == LARGE
        break


def test_a_full_flash_keeps_the_old_image_and_room_for_a_smaller_one():
    flash = Flash(room=100)
    store = ImageFile("car.image", flash, flash.open)
    store.save(SMALL)
    with pytest.raises(OSError, match="28"):
        store.save(LARGE)
    assert store.load() == SMALL
    assert list(flash.files) == ["car.image"]
    store.save(EMPTY)
    assert store.load() == EMPTY


@given(images())
def test_every_image_is_loaded_as_it_was_stored(image):
    flash = Flash()
    ImageFile("car.image", flash, flash.open).save(image)
    assert ImageFile("car.image", flash, flash.open).load() == image
