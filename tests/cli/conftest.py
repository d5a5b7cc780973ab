"""What several commands are given."""

import pytest

# One state: forward at 200 mm/s for 1 s; and a follower's word.
IMAGE = bytes.fromhex("01010100 64800000 E4800000")


@pytest.fixture
def image(tmp_path):
    """A file with an image of three words."""
    path = tmp_path / "it.image"
    path.write_bytes(IMAGE)
    return path
