"""The table of what cars show: a moment, the picture of it and its recording have the same columns."""

import numpy as np
import pytest

from motorcade.engine.moment import COLUMNS, FLAGS, PICTURED, first_cars, moment_bytes, to_moment, unpack_moment
from motorcade.engine.pictures import Pictures
from motorcade.runs.recorder import open_recording
from support.recorded_run import record, world


def test_a_picture_has_the_columns_of_the_moment_and_stays_within_the_table():
    cars = world()
    pictures = Pictures(cars)
    for _ in range(20):
        cars.run(100)
        shown, data = cars.snapshot().in_single_precision(), pictures.moment(is_stored=False)
        assert len(data) == moment_bytes(cars.cars)
        packed = unpack_moment(data, cars.cars)
        assert list(packed) == list(PICTURED)
        for name, column in COLUMNS.items():
            now = np.asarray(getattr(shown, name))
            if column.is_pictured:
                assert np.asarray(packed[name]).tobytes() == now.tobytes(), name
                assert np.array_equal(getattr(to_moment(0, data, cars.cars), name), now)
            if name in FLAGS:
                assert np.array_equal(np.asarray(packed["flags"]) & FLAGS[name] > 0, now), name
            if column.limits:
                least, most = column.limits
                # Single precision rounds pi up.
                assert least - 1e-6 <= now.min() <= now.max() <= most + 1e-6, name


@pytest.mark.parametrize("shown", [0, 1, 4, 5])
def test_the_first_cars_of_a_picture_are_a_picture(shown):
    cars = world()
    data = Pictures(cars).moment(is_stored=False)
    part = unpack_moment(first_cars(data, cars.cars, shown), shown)
    assert {name: each.tolist() for name, each in part.items()} == {
        name: each.tolist()[:shown] for name, each in unpack_moment(data, cars.cars).items()
    }


def test_a_recording_has_all_columns(tmp_path):
    cars = world()
    recorded = record([tmp_path / "run.mcap"], cars, duration_ms=500)
    for mine, read in zip(recorded.moments(), open_recording(tmp_path / "run.mcap").moments(), strict=True):
        for name, column in COLUMNS.items():
            assert getattr(read, name).dtype == column.packed
            assert getattr(read, name) == pytest.approx(getattr(mine, name), abs=1e-6)
