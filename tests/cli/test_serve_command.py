"""``motorcade drive serve`` as its users start, reach and end it."""

import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from motorcade.locales import text as text_of
from motorcade.words.formats import DRIVE
from support.command_line import refusal, started
from support.waiting import DEADLINE_S

CLASSROOM = Path(__file__).parents[2] / "src" / "motorcade" / "profiles" / "classroom.toml"
STILL = DRIVE.encode(angle=40, direction=1, speed=0)
AHEAD = DRIVE.encode(angle=40, direction=1, speed=200)


def served(*options: str) -> AbstractContextManager[tuple[subprocess.Popen, dict]]:
    """A car in a process of its own, and where it says that it is."""
    return started("drive", "serve", "--port", "0", *options)


@contextmanager
def driven(told: dict, packed: bytes, state: str = "standing") -> Iterator[dict]:
    """What telemetry tells once somebody sends ``packed`` again and again, who then stays."""
    with (
        socket.create_connection(("127.0.0.1", told["port"]), DEADLINE_S) as commands,
        socket.create_connection(("127.0.0.1", told["telemetry_port"]), DEADLINE_S) as telemetry,
        telemetry.makefile("rb") as frames,
    ):
        for _ in range(100):
            commands.sendall(packed)
            (size,) = struct.unpack(">I", frames.read(4))
            frame = json.loads(frames.read(size))
            if frame["state"] == state:
                yield frame
                return
    raise AssertionError("the car never heard the command")


def test_a_simulated_car_takes_commands_and_ends_by_a_signal(tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    with served("--log", str(log)) as (process, told):
        assert (told["host"], told["tls"]) == ("127.0.0.1", False)
        with driven(told, struct.pack(">I", STILL)) as frame:
            assert (frame["angle_deg"], frame["direction"], frame["speed"]) == (40, 1, 0)
            said = next((line for line in process.stderr if "drives" in line), "")
        if os.name == "posix":
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=DEADLINE_S)
            assert process.returncode == 0
            log_lines = [json.loads(line) for line in log.read_text().splitlines()]
            assert [each["did"] for each in log_lines] == ["drives", "ends"]
            assert log_lines[0]["who"].startswith("127.0.0.1:")
        assert "standing; 127.0.0.1:" in said


def test_a_car_that_asks_for_arming_and_measures_its_battery_tells_both_in_either_order_of_bytes(
    tmp_path: Path,
) -> None:
    battery = tmp_path / "voltage_now"
    battery.write_text("7412000\n")
    with served("--arming", "--battery", str(battery), "--byte-order", "little") as (_, told):
        with driven(told, struct.pack("<I", AHEAD), "disarmed") as frame:
            assert (frame["speed"], frame["battery_mv"], frame["obstacle_mm"]) == (0, 7412, None)
        with driven(told, struct.pack("<I", STILL)):
            pass


def test_a_served_car_has_the_limits_of_its_profile(tmp_path: Path) -> None:
    profile = tmp_path / "careful.toml"
    text = CLASSROOM.read_text(encoding="utf-8")
    profile.write_text(text.replace("arming = false", "arming = true"), encoding="utf-8")
    with served("--profile", str(profile)) as (_, told), driven(told, struct.pack(">I", AHEAD), "disarmed") as frame:
        assert frame["speed"] == 0


def test_telemetry_is_at_the_port_after_that_of_commands_unless_another_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with started("drive", "serve", "--port", str(port)) as (_, told):
        assert (told["port"], told["telemetry_port"]) == (port, port + 1)
    with served("--telemetry-port", str(port)) as (_, told):
        assert told["telemetry_port"] == port


def test_other_computers_reach_a_car_only_where_its_owner_said_so(tmp_path: Path) -> None:
    sentence = refusal(2, "drive", "serve", "--port", "0", "--host", "0.0.0.0")
    assert sentence.startswith("at 0.0.0.0 others can reach this car")
    assert "--insecure-lan" in sentence
    with served("--host", "0.0.0.0", "--insecure-lan") as (process, told):
        assert told["host"] == "0.0.0.0"
        assert "Everybody who reaches 0.0.0.0 may drive this car" in process.stderr.readline()


def test_what_cannot_be_is_said_in_a_sentence(tmp_path: Path) -> None:
    keys = tmp_path / "car-ada.pem"
    assert "exclude each other" in refusal(2, "drive", "serve", "--keys", keys, "--insecure-lan")
    assert "can't be read" in refusal(2, "drive", "serve", "--keys", keys)
    assert "--pins" in refusal(2, "drive", "serve", "--board", "raspberry-pi")
    for unread in ("volts", "7.4 V"):
        (tmp_path / "in0_input").write_text(unread)
        sentence = refusal(3, "drive", "serve", "--battery", tmp_path / "in0_input")
        assert f"{unread} is no voltage" in sentence
    assert "no address of this computer" in refusal(2, "drive", "serve", "--host", "no.such.host.invalid")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert f"port {port} is taken" in refusal(2, "drive", "serve", "--port", port)


def test_a_car_speaks_chinese_to_who_serves_it() -> None:
    command = [sys.executable, "-m", "motorcade", "drive", "serve", "--port", "0", "--language", "zh"]
    text = {"encoding": "utf-8", "env": {**os.environ, "PYTHONUTF8": "1"}}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **text) as process:
        try:
            said = process.stdout.readline()
            ports = re.fullmatch(
                r"小车在 127\.0\.0\.1 的端口 (\d+) 接收指令，遥测在端口 (\d+)。 按 Ctrl-C 结束。\n", said
            )
            assert ports, said
            with driven({"port": int(ports[1]), "telemetry_port": int(ports[2])}, struct.pack(">I", STILL)):
                assert any("停住；127.0.0.1:" in line for line in process.stderr)
            if os.name == "posix":
                process.send_signal(signal.SIGTERM)
                last_line = text_of("command_line", "serve-ended", {}, "zh")
                assert process.communicate(timeout=DEADLINE_S)[0] == f"{last_line}\n"
        finally:
            process.kill()
