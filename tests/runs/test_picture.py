"""Plots and films of recordings."""

import subprocess
from pathlib import Path
from unittest import mock

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from motorcade.errors import MotorcadeError, Phrase
from motorcade.runs import drawing, video
from motorcade.runs.drawing import pictures_in
from motorcade.runs.palette import LEADER, rgb
from motorcade.runs.plots import Thinned, draw_plots
from motorcade.runs.recording import Description, InMemoryRecording
from motorcade.runs.video import SIZES, draw_film
from support.recorded_run import crowd, record, world

# Only these tests use imageio-ffmpeg's reader, which leaves closing its pipes to the garbage collector.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


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


# plots


@pytest.mark.parametrize("kind", ["tracks", "words", "air"])
@pytest.mark.parametrize("run", ["recording", "many"])
def test_a_plot_of_each_kind_is_a_picture_with_many_colours(kind, run, request, tmp_path):
    path = tmp_path / "plot.png"
    done = []
    drawn = request.getfixturevalue(run)
    draw_plots(drawn, path, [kind], progress=done.append)
    with Image.open(path) as picture:
        assert (picture.format, picture.size) == ("PNG", (960, 720))
    assert len(np.unique(pixels(path), axis=0)) > 20
    assert done[-1] == drawn.last_ms


def test_the_three_plots_share_a_picture(recording, tmp_path):
    draw_plots(recording, tmp_path / "plot.png")
    with Image.open(tmp_path / "plot.png") as picture:
        assert picture.size == (1800, 900)


def test_the_texts_of_a_picture_are_in_english_where_no_font_has_the_letters(recording, tmp_path, monkeypatch):
    # Matplotlib's own fonts have no Chinese letters.
    monkeypatch.setattr(drawing, "_CHINESE_FONTS", ("STIXGeneral", "no such font"))
    with pictures_in("zh") as language:
        draw_plots(recording, tmp_path / "air.svg", ["air"])
    assert language == "en"
    assert Phrase("picture-sent-rate").sentence("en") in (tmp_path / "air.svg").read_text(encoding="utf-8")


def test_the_texts_of_a_picture_are_in_its_language_where_a_font_has_the_letters(recording, tmp_path, monkeypatch):
    # It comes with Matplotlib, and has a sign for every letter.
    monkeypatch.setattr(drawing, "_CHINESE_FONTS", ("Last Resort High-Efficiency",))
    with pictures_in("zh") as language:
        draw_plots(recording, tmp_path / "air.svg", ["air"])
    assert language == "zh"
    assert Phrase("picture-sent-rate").sentence("zh") in (tmp_path / "air.svg").read_text(encoding="utf-8")


def test_tracks_show_the_leader_in_red_and_the_wall_in_dark_grey(recording, tmp_path):
    draw_plots(recording, tmp_path / "tracks.png", ["tracks"])
    assert share_of(LEADER, tmp_path / "tracks.png") > 0.0005
    assert share_of("#3a3a3a", tmp_path / "tracks.png") > 0.005


def test_a_spreading_word_is_drawn_in_its_colour(many, tmp_path):
    """The word reaches half of the cars of a square when its circle has half of the square's area."""
    draw_plots(many, tmp_path / "words.png", ["words"])
    held, none = (share_of(colour, tmp_path / "words.png") for colour in ("#1f77b4", "#c4c4c4"))
    assert held > 0.2
    assert none > 0.2


def test_the_caller_names_the_words(recording, tmp_path):
    named = []
    draw_plots(recording, tmp_path / "words.svg", ["words"], lambda word: named.append(word) or f"word {word & 1}")
    assert len(named) == len(set(named)) >= 3


@pytest.mark.parametrize("name", ["plot.svg", "plot.pdf"])
def test_pictures_are_also_written_as_svg_and_pdf(name, recording, tmp_path):
    draw_plots(recording, tmp_path / name, ["tracks"])
    assert (tmp_path / name).read_bytes()[:5] in (b"<?xml", b"%PDF-")


def test_a_recording_without_a_moment_is_not_drawn(recording, tmp_path):
    empty = InMemoryRecording(recording.about, "empty.mcap")
    for draw, name in ((draw_plots, "a.png"), (draw_film, "a.gif")):
        with pytest.raises(MotorcadeError, match=r"empty.mcap holds no moment of the run: there is nothing to draw"):
            draw(empty, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_long_series_is_thinned_evenly_and_keeps_both_ends():
    series = Thinned(100)
    for number in range(10_000):
        series.add(number)
    items = series.items()
    assert (items[0], items[-1]) == (0, 9999)
    assert 50 < len(items) <= 102
    assert set(np.diff(items[:-1])) == {128}


# films


def test_the_notice_names_the_licence_of_the_ffmpeg_that_is_installed():
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-L"]
    licence = " ".join(subprocess.run(command, capture_output=True, check=True, text=True).stdout.split())
    notice = " ".join((Path(__file__).parents[2] / "NOTICE").read_text(encoding="utf-8").split())
    assert "GNU General Public License" in licence
    assert "either version 3 of the License, or (at your option) any later version" in licence
    assert "GNU General Public License, version 3 or later" in notice


def frames_of(path):
    film = imageio_ffmpeg.read_frames(str(path))
    size = next(film)["size"]
    return size, [np.frombuffer(image, np.uint8).reshape(size[1], size[0], 3) for image in film]


def test_an_mp4_has_an_image_for_each_moment(recording, tmp_path):
    path, done = tmp_path / "run.mp4", []
    draw_film(recording, path, progress=done.append)
    size, images = frames_of(path)
    assert size == SIZES[".mp4"][0]
    assert len(images) == len(done) == 31
    assert done[-1] == 3000
    # Below the title, places that a car has left are white.
    first, last = (image[60:].min(axis=2) for image in (images[0], images[-1]))
    assert np.count_nonzero((first < 200) & (last > 240)) > 1000
    _, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert seconds == pytest.approx(3.1, abs=0.05)


def test_a_gif_has_an_image_for_each_moment(recording, tmp_path):
    draw_film(recording, tmp_path / "run.gif")
    with Image.open(tmp_path / "run.gif") as film:
        assert (film.n_frames, film.size, film.info["duration"]) == (31, SIZES[".gif"][0], 100)
        film.seek(5)
        film.convert("RGB").save(tmp_path / "one.png")
    assert share_of(LEADER, tmp_path / "one.png") > 0.0002


@pytest.mark.parametrize(("speed", "images", "seconds"), [(2, 31, 1.55), (6, 16, 0.53), (0.5, 31, 6.2)])
def test_a_faster_film_shows_at_most_thirty_images_a_second(speed, images, seconds, recording, tmp_path):
    draw_film(recording, tmp_path / "run.mp4", speed)
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "run.mp4")) == (images, pytest.approx(seconds, abs=0.1))


def test_a_film_of_many_cars_shows_their_words(many, tmp_path):
    draw_film(many, tmp_path / "many.mp4")
    size, images = frames_of(tmp_path / "many.mp4")
    assert size == SIZES[".mp4"][1]
    Image.fromarray(images[-1]).save(tmp_path / "last.png")
    Image.fromarray(images[0]).save(tmp_path / "first.png")
    assert share_of("#1f77b4", tmp_path / "last.png", 40) > 10 * share_of("#1f77b4", tmp_path / "first.png", 40)


def test_a_gif_that_is_too_long_is_refused_in_a_sentence(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(video, "MOST_GIF_IMAGES", 10)
    with pytest.raises(MotorcadeError, match=r"a GIF has at most 10 images, .* write an .mp4"):
        draw_film(recording, tmp_path / "run.gif")
    assert not list(tmp_path.iterdir())


def test_a_film_that_fails_leaves_the_old_file(recording, tmp_path, monkeypatch):
    (tmp_path / "run.mp4").write_bytes(b"old")
    monkeypatch.setattr(imageio_ffmpeg, "write_frames", mock.Mock(side_effect=OSError("the disk is full\nand more")))
    with pytest.raises(MotorcadeError, match=r"run.mp4 can't be drawn: the disk is full$"):
        draw_film(recording, tmp_path / "run.mp4")
    assert [file.name for file in tmp_path.iterdir()] == ["run.mp4"]
    assert (tmp_path / "run.mp4").read_bytes() == b"old"


def test_a_description_is_read_back_from_its_texts(recording):
    assert Description.from_texts(recording.about.to_texts()) == recording.about
