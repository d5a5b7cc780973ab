"""Pipes that somebody has put in place of the files that commands read and write."""

import os
import sys

import pytest

from support.command_line import PARADE, run


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's pipes")
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("class/class.json", ("class", "--no-browser", "--host", "127.0.0.1", "--port", 0, "--folder", "class")),
        ("https/authority.pem", ("drive", "keys", "https", "--car", "ada")),
        ("https/issued.pem", ("drive", "keys", "https", "--car", "ada")),
        ("car.pem", ("drive", "serve", "--port", 0, "--keys", "car.pem")),
        ("mat.toml", ("drive", "serve", "--port", 0, "--mat", "mat.toml")),
        ("in0_input", ("car", "run", "--board", "simulated", "--tcp", "127.0.0.1:0", "--battery", "in0_input")),
        ("cars.toml", ("cars", "stop", "--list", "cars.toml")),
        ("sweep.toml", ("sweep", "sweep.toml", "-o", "table.parquet")),
        ("run.mcap", ("replay", "run.mcap")),
        ("out.image", ("compile", PARADE, "-o", "out.image")),
        ("log", ("class", "--no-browser", "--host", "127.0.0.1", "--port", 0, "--folder", "class", "--log", "log")),
        ("log", ("drive", "serve", "--port", 0, "--log", "log")),
        ("dog", ("car", "run", "--board", "simulated", "--tcp", "127.0.0.1:0", "--watchdog", "dog")),
        ("run.mcap", ("simulate", PARADE, "--seconds", 1, "--record", "run.mcap")),
        ("tracks.png", ("simulate", PARADE, "--seconds", 1, "--record", "tracks.png")),
        ("library.zip", ("arduino-library", "-o", "library.zip")),
    ],
)
def test_a_pipe_in_place_of_a_file_ends_a_command_in_a_sentence(tmp_path, monkeypatch, name, command):
    """Nobody is at the pipe's other end."""
    monkeypatch.chdir(tmp_path)
    pipe = tmp_path / name
    pipe.parent.mkdir(exist_ok=True)
    os.mkfifo(pipe)
    said = run(*command)
    assert said.code in (2, 3)
    assert pipe.name in said.err
    assert any(words in said.err for words in ("pipe", "cut or changed", "no such device"))


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's links")
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("run.mcap.part", ("simulate", PARADE, "--seconds", 1, "--record", "run.mcap")),
        ("library/Motorcade/library.properties", ("arduino-library", "-o", "library")),
    ],
)
def test_what_a_command_writes_on_the_way_follows_no_link_that_somebody_has_put_there(
    tmp_path, monkeypatch, name, command
):
    monkeypatch.chdir(tmp_path)
    precious = tmp_path / "precious"
    precious.write_text("mine")
    link = tmp_path / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(precious)
    assert run(*command).code == 0
    assert precious.read_text() == "mine"
