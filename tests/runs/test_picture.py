"""Pictures and films of recordings."""

import re
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from PIL import Image

from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.model import Line
from motorcade.runs import drawing, plots
from motorcade.runs.drawing import pictures_in
from motorcade.runs.plots import SIZES, draw_film, draw_tracks
from motorcade.runs.recording import FOLLOWERS, LEADER, InMemoryRecording, rgb
from support.recorded_run import crowd, record, world


@pytest.fixture(scope="module")
def recording():
    """Three seconds of six cars."""
    return record([], world(seeds=7))


@pytest.fixture(scope="module")
def many():
    """2,500 cars, 30 moments."""
    return crowd(2500, 30)


def pixels(path):
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB")).reshape(-1, 3)


def share_of(colour, path, tolerance=12):
    """The share of pixels that are nearly ``#rrggbb``."""
    wanted = np.array(rgb(colour)) * 255
    return np.mean(np.all(np.abs(pixels(path) - wanted) < tolerance, axis=1))


# pictures


# The last one comes with Matplotlib, and has a sign for every letter; Matplotlib's other fonts have no Chinese ones.
@pytest.mark.parametrize(("font", "written"), [("STIXGeneral", "en"), ("Last Resort High-Efficiency", "zh")])
def test_a_pictures_texts_are_in_its_language_where_a_font_has_the_letters(
    font, written, recording, tmp_path, monkeypatch
):
    monkeypatch.setattr(drawing, "_CHINESE_FONTS", ("no such font", font))
    with pictures_in("zh") as language:
        draw_tracks(recording, tmp_path / "tracks.svg")
    assert language == written
    assert Phrase("picture-one-leader").sentence(written) in (tmp_path / "tracks.svg").read_text(encoding="utf-8")


def test_tracks_show_the_leader_in_red_and_the_wall_in_dark_grey(recording, tmp_path):
    done = []
    draw_tracks(recording, tmp_path / "tracks.png", done.append)
    assert done[-1] == recording.last_ms
    assert share_of(LEADER, tmp_path / "tracks.png") > 0.0005
    assert share_of("#3a3a3a", tmp_path / "tracks.png") > 0.005


@pytest.mark.parametrize(("run", "leads", "follow", "tracks"), [("recording", 2.2, 1.2, 5), ("many", 1.2, 0.6, 1250)])
def test_a_leaders_track_is_wide_and_of_many_followers_every_other_has_one(
    run, leads, follow, tracks, request, tmp_path
):
    draw_tracks(request.getfixturevalue(run), tmp_path / "tracks.svg")
    text = (tmp_path / "tracks.svg").read_text(encoding="utf-8")
    drawn = re.findall(r"fill: none; stroke: (#\w+); stroke-opacity: [\d.]+; stroke-width: ([\d.]+)", text)
    assert [float(width) for colour, width in drawn if colour == LEADER] == [leads]
    assert [float(width) for colour, width in drawn if colour in FOLLOWERS] == [follow] * tracks


def test_tracks_show_roads_with_their_lines_and_what_is_dark(recording, tmp_path):
    line = Line(((0.0, 0.0), (3.0, 0.0), (3.0, 2.0)), bend_m=0.3)
    marks = {"lines": (line,), "spots": ((1.0, 1.0, 0.2),), "patches": (((2, 1), (2.5, 1), (2.5, 1.5)),)}
    about = replace(recording.about, mat=replace(recording.about.mat, **marks))
    draw_tracks(mock.Mock(wraps=recording, about=about, last_ms=recording.last_ms), tmp_path / "tracks.png")
    assert share_of("#b9bdc4", tmp_path / "tracks.png") > 0.005
    assert share_of("#17181c", tmp_path / "tracks.png") > 0.005


def test_a_recording_without_a_moment_is_not_drawn(recording, tmp_path):
    empty = InMemoryRecording(recording.about)
    for draw, name in ((draw_tracks, "a.png"), (draw_film, "a.gif")):
        with pytest.raises(MotorcadeError, match=r"the run holds no moment of the run: there is nothing to draw"):
            draw(empty, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_long_run_is_drawn_with_few_points_of_each_track_from_both_its_ends(recording, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(plots, "_MOST_POINTS", 0)
    monkeypatch.setattr(plots, "_draw_tracks", lambda figure, about, cars, tracks, last: drawn.append(tracks))
    moments = list(recording.moments())
    long = InMemoryRecording(recording.about)
    for number in range(1000):
        long.write(moments[number % len(moments)]._replace(t_ms=100 * number))
    draw_tracks(long, tmp_path / "plot.png")
    (tracks,) = drawn
    assert 25 < tracks.shape[1] <= 52
    *_, last = long.moments()
    for place, moment in ((0, moments[0]), (-1, last)):
        np.testing.assert_array_equal(np.sort(tracks[:, place, 0]), np.sort(moment.x_m))


# films


@pytest.mark.parametrize(("speed", "images", "duration_ms"), [(1, 31, 100), (6, 6, 100), (0.5, 31, 200)])
def test_a_film_has_an_image_for_each_moment_and_at_most_ten_a_second(speed, images, duration_ms, recording, tmp_path):
    draw_film(recording, tmp_path / "run.gif", speed)
    with Image.open(tmp_path / "run.gif") as drawn:
        assert (drawn.n_frames, drawn.size, drawn.info["duration"]) == (images, SIZES[0], duration_ms)


def test_a_film_of_many_cars_shows_their_words(many, tmp_path):
    draw_film(many, tmp_path / "many.gif")
    with Image.open(tmp_path / "many.gif") as drawn:
        assert drawn.size == SIZES[1]
        for number, name in ((0, "first.png"), (drawn.n_frames - 1, "last.png")):
            drawn.seek(number)
            drawn.convert("RGB").save(tmp_path / name)
    assert share_of("#1f77b4", tmp_path / "last.png", 40) > 10 * share_of("#1f77b4", tmp_path / "first.png", 40)


def test_a_gif_that_is_too_long_is_refused_in_a_sentence(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(plots, "MOST_GIF_IMAGES", 10)
    with pytest.raises(MotorcadeError, match=r"a GIF has at most 10 images, .* draw it at a higher speed"):
        draw_film(recording, tmp_path / "run.gif")
    assert not list(tmp_path.iterdir())


def test_a_film_that_fails_leaves_the_old_file(recording, tmp_path, monkeypatch):
    (tmp_path / "run.gif").write_bytes(b"old")
    monkeypatch.setattr(Image.Image, "save", mock.Mock(side_effect=OSError(28, "No space left")))
    with pytest.raises(MotorcadeError, match=r"run.gif can't be drawn: the disk is full$"):
        draw_film(recording, tmp_path / "run.gif")
    assert [file.name for file in tmp_path.iterdir()] == ["run.gif"]
    assert (tmp_path / "run.gif").read_bytes() == b"old"
