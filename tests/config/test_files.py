"""Files that are replaced whole or not at all, and stay replaced."""

import errno
import os
import stat
import sys
from pathlib import Path

import pytest

from motorcade.config.files import locked, parse, read_bytes, read_text, replace_file
from motorcade.errors import InputError, MotorcadeError


def test_a_file_is_replaced_whole_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "car.image"
    replace_file(path, b"old")
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_disk_that_fails_keeps_the_old_file(tmp_path, monkeypatch, step):
    path = tmp_path / "car.image"
    replace_file(path, b"old")

    def fail(*arguments):
        raise OSError("the disk is full")

    monkeypatch.setattr(os, step, fail)
    with pytest.raises(OSError, match="full"):
        replace_file(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps names by itself")
def test_the_data_is_on_the_disk_before_its_name_and_the_name_before_it_is_done(tmp_path, monkeypatch):
    path, synced = tmp_path / "car.image", []
    sync = os.fsync

    def watch(handle):
        kind = "folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file"
        synced.append((kind, path.exists()))
        sync(handle)

    monkeypatch.setattr(os, "fsync", watch)
    replace_file(path, b"new")
    assert synced == [("file", False), ("folder", True)]


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "磁盘满了"),
        (errno.EROFS, "磁盘只能读"),
        (errno.EACCES, "没有权限"),
        (errno.ENOENT, "没有这个文件或文件夹"),
        (errno.EXDEV, os.strerror(errno.EXDEV)),
    ],
)
def test_what_the_system_refuses_is_told_in_the_readers_language(number, words):
    refused = MotorcadeError("cant-save", reason=OSError(number, os.strerror(number)))
    assert words in refused.sentence("zh")


def test_a_lock_holds_though_its_file_is_deleted(tmp_path):
    lock, refusal = tmp_path / "lock", MotorcadeError("class-is-running", folder=tmp_path)
    with locked(lock, refusal):
        if sys.platform != "win32":
            lock.unlink()
        with pytest.raises(MotorcadeError) as refused, locked(lock, refusal):
            pass
        assert refused.value is refusal
    with locked(lock, refusal):
        pass


def test_a_file_that_is_too_large_is_not_read_to_its_end(tmp_path):
    huge = tmp_path / "huge"
    with huge.open("wb") as file:
        file.truncate(5 << 30)
    with pytest.raises(MotorcadeError, match="more than 1 MiB"):
        read_bytes(huge, 1 << 20)


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's pipes and devices")
@pytest.mark.parametrize("put", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
def test_a_pipe_or_a_device_in_place_of_a_file_keeps_neither_reader_nor_writer(tmp_path, put):
    """Nobody is at the pipe's other end."""
    there = tmp_path / "there"
    put(there)
    with pytest.raises(MotorcadeError) as refused:
        read_text(there, "there")
    assert "no file but a pipe or a device" in refused.value.sentence("en")
    assert "管道或设备" in refused.value.sentence("zh")
    with pytest.raises(OSError, match="Illegal seek"):
        replace_file(there, b"new")
    assert not there.is_file()
    assert list(tmp_path.iterdir()) == [there]


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="this system has no /dev/fd")
def test_what_a_shell_hands_over_is_read_and_written():
    reader, writer = os.pipe()
    replace_file(Path(f"/dev/fd/{writer}"), b"a program")
    os.close(writer)
    assert read_bytes(Path(f"/dev/fd/{reader}")) == b"a program"
    os.close(reader)


def test_a_file_of_toml_that_takes_long_to_read_is_refused():
    """A list of cars or a profile that somebody left in a folder keeps no stop waiting."""
    assert parse("\n" * (1 << 20), "TOML", "cars.toml") == {}
    with pytest.raises(InputError, match=r"cars\.toml has more than 1 MiB"):
        parse("\n" * (1 << 20) + "a = 1", "TOML", "cars.toml")
    assert parse(" " * (1 << 21) + "1", "JSON", "mat.json") == 1
