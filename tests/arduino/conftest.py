"""Arduino cars on emulated chips: their programs are compiled as the Arduino IDE compiles them."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from filelock import FileLock
from scripts import debian

from motorcade.config.pins import load_pins
from motorcade.config.profile import built_in_profile
from motorcade.firmware.arduino_library import library_files, library_folder, sketch_files
from motorcade.firmware.shop import shop_car
from support import arduino_build
from support.arduino_build import MEGA, UNO, ArduinoProgram, Target
from support.emulated_chips import ChipWorld

HERE = Path(__file__).parent
PIN_FILES = {UNO: "uno.toml", MEGA: "mega.toml"}
Compiler = Callable[..., ArduinoProgram]


@pytest.fixture(scope="session")
def tools(install_lock: FileLock) -> None:
    """avr-gcc, Arduino's core and simavr are installed; skip loudly where they can't be."""
    packages = debian.FOR_TESTS["avr-gcc"]
    needed = (arduino_build.CORE, Path("/usr/include/simavr/sim_avr.h"))
    with install_lock:
        if not (debian.find_or_install("avr-gcc", *packages) and all(path.exists() for path in needed)):
            debian.install(*packages)
    if not all(path.exists() for path in needed):
        pytest.skip(f"no emulated Arduino (on Debian: apt-get install {' '.join(packages)})")


@pytest.fixture(scope="session")
def compiled(tools: None, build_lock: FileLock) -> Compiler:
    """Compiles a sketch of the library."""

    def compile_sketch(sketch: str, target: Target, files: dict[str, bytes] | None = None) -> ArduinoProgram:
        with build_lock:
            return arduino_build.compile_sketch(files or library_files(), sketch, target)

    return compile_sketch


@pytest.fixture(scope="session")
def car_program(compiled: Compiler) -> Callable[..., ArduinoProgram]:
    """Compiles the ready car for a board, as a leader or a follower."""

    def compile_car(is_leader: bool, target: Target = UNO, extra: dict[str, bytes] | None = None) -> ArduinoProgram:
        pins = load_pins(library_folder() / PIN_FILES[target])
        own = sketch_files(pins, built_in_profile("classroom"), is_leader, number=1)
        return compiled("examples/Car", target, {**library_files(), **own, **(extra or {})})

    return compile_car


@pytest.fixture(scope="session")
def shop_program(compiled: Compiler) -> Callable[[str], ArduinoProgram]:
    """Compiles the sketch for a car from a shop."""

    def compile_car(name: str) -> ArduinoProgram:
        own = sketch_files(shop_car(name), built_in_profile(name), is_leader=False, number=1)
        return compiled("examples/Car", UNO, {**library_files(), **own})

    return compile_car


@pytest.fixture(scope="session")
def chips_library(tools: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """chips.c as a shared library."""
    library = tmp_path_factory.mktemp("chips") / "libchips.so"
    strict = ["-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["gcc", *strict, "-o", str(library), str(HERE / "chips.c"), "-lsimavr"], check=True)
    return library


@pytest.fixture
def world(chips_library: Path) -> Iterator[ChipWorld]:
    """An empty world of chips."""
    made = ChipWorld(chips_library)
    yield made
    made.close()
