"""Measure first starts: run ``python benchmarks/first_start.py``.

Times are those of a clock, from the command until cars have moved, the best of some starts, since other programs of the
computer only add to them. ``--install`` also measures, in fresh virtual environments, how large installations are; this
needs a network.
"""

import json
import socket
import struct
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from functools import partial
from pathlib import Path

from playwright.sync_api import sync_playwright
from rich.console import Console
from rich.table import Table
from swarm import result

from motorcade.words.formats import DRIVE

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts import chromium
from scripts.studio_process import ROOT, build_page, project_link, running_studio

STARTS = 5
SIMULATE_GOAL_S, STUDIO_GOAL_S = 1.5, 3.0
PARADE = ROOT / "examples" / "parade.motorcade.json"
HAS_MOVED = "() => document.querySelector('.motorcade-running') !== null"


def best_s(start: Callable[[], float]) -> float:
    """The shortest time of some starts."""
    return min(start() for _ in range(STARTS))


def simulate_s(*options: str) -> float:
    """From the command until its result is printed: 0.1 s of driving."""
    began_s = time.perf_counter()
    command = [sys.executable, "-m", "motorcade", "simulate", str(PARADE), "--seconds", "0.1", *options]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began_s


def serve_s() -> float:
    """From the command until the simulated car says that it moves, for a client that asks it to at once."""
    began_s = time.perf_counter()
    command = [sys.executable, "-m", "motorcade", "drive", "serve", "--port", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as car:
        assert car.stdout
        told = json.loads(car.stdout.readline())
        still, forward = (
            struct.pack(">I", DRIVE.encode(angle=90, direction=1, speed=speed) & 0xFFFFFFFF) for speed in (0, 200)
        )
        with (
            socket.create_connection(("127.0.0.1", told["port"])) as commands,
            socket.create_connection(("127.0.0.1", told["telemetry_port"])) as telemetry,
            telemetry.makefile("rb") as frames,
        ):
            state, word = "", still
            while state != "moving":
                commands.sendall(word)
                (size,) = struct.unpack(">I", frames.read(4))
                state = json.loads(frames.read(size))["state"]
                word = forward if state == "standing" else word
        taken_s = time.perf_counter() - began_s
        car.kill()
    return taken_s


def studio_s() -> float:
    """From the opening of the page in a browser until the leader's program runs on the mat, played by a click."""
    with tempfile.TemporaryDirectory() as library, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium.find_or_install())
        page = browser.new_page()
        with running_studio(Path(library)) as studio:
            began_s = time.perf_counter()
            page.goto(project_link(studio.url, json.loads(PARADE.read_text(encoding="utf-8"))))
            page.get_by_role("button", name="Play", exact=True).click()
            page.wait_for_function(HAS_MOVED, polling="raf")
            taken_s = time.perf_counter() - began_s
        browser.close()
    return taken_s


def studio_ready_s() -> float:
    """From the command until the studio prints its address."""
    with tempfile.TemporaryDirectory() as library:
        began_s = time.perf_counter()
        with running_studio(Path(library)):
            return time.perf_counter() - began_s


def installed_mb(extras: str) -> float:
    """The size of an installation without pip, in MB of 10^6 bytes."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = next(path for path in Path(folder).glob("*/python*") if path.stem == "python")
        packages = Path(folder)
        before = size_of(packages)
        install = [str(python), "-m", "pip", "install", "--quiet", f"{ROOT}[{extras}]"]
        subprocess.run(install, check=True)
        return (size_of(packages) - before) / 1e6


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink())


def main() -> None:
    table = Table("", "figure", "goal", "", title=f"First start, best of {STARTS}")

    def add(name: str, figure_s: float, goal_s: float | None = None) -> None:
        goal = ("", "") if goal_s is None else (f"≤ {goal_s} s", result(figure_s, goal_s, least=False))
        table.add_row(name, f"{figure_s:.2f} s", *goal)

    for followers in ("5", "1000"):
        taken_s = best_s(partial(simulate_s, "--followers", followers))
        add(f"simulate, {followers} followers", taken_s, SIMULATE_GOAL_S)
    add("drive serve: the simulated car moves", best_s(serve_s), SIMULATE_GOAL_S)
    add("studio: its address is printed", best_s(studio_ready_s))
    if chromium.find_or_install():
        build_page()
        add("studio: cars drive, from the browser's opening", best_s(studio_s), STUDIO_GOAL_S)
    if "--install" in sys.argv:
        for extras in ("world", "studio", "studio,runs", "studio,sim"):
            table.add_row(f"installation of motorcade\\[{extras}]", f"{installed_mb(extras):.0f} MB", "", "")
    Console().print(table)


if __name__ == "__main__":
    main()
