"""Upload and readback over real lines (a pseudo-terminal and TCP), to a simulated car and to cars that go wrong."""

import contextlib
import gc
import os
import sys
from functools import partial
from pathlib import Path

import pytest
import serial
from serial.tools.list_ports_common import ListPortInfo

from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import TcpPort
from motorcade.config.profile import built_in_profile
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import NO_ANSWER, PORT_BUSY, PORT_FORBIDDEN, PORT_NOT_FOUND, REFUSED, VERIFICATION, WENT_AWAY
from motorcade.upload import serial_port
from motorcade.upload import transfer as talk
from motorcade.words import upload as protocol
from motorcade.words.request import CHECK_BYTES
from motorcade.words.upload import READBACK_REQUEST
from support.driven_car import deaf_port
from support.impatience import give_up_after
from support.played_car import IMAGE, PlayedCar
from support.pseudo_terminal import PseudoTerminal
from support.socket_lines import without_pauses
from support.upload_ends import read_check

CLASSROOM = built_in_profile("classroom")
OK = b"OK words=2 crc32=fcf9a423\n"
LARGEST = bytes.fromhex("FFFF0100" + "64800000" * 255 + "C0280000" * 255)
upload = partial(serial_port.upload, image=IMAGE, baud=115200)
readback = partial(serial_port.readback, baud=115200)
POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
PTY = pytest.param("pty", marks=POSIX_ONLY)
every_line = pytest.mark.parametrize("kind", [PTY, "tcp"])


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    """Before it sends, the uploader lets the line settle; pyserial rests a while after each socket that it closes."""
    monkeypatch.setattr(talk, "SETTLE_MS", 0)
    monkeypatch.setattr(talk, "BOOT_MS", 0)
    without_pauses(monkeypatch)


@pytest.fixture
def car(kind):
    with contextlib.closing(PlayedCar(kind)) as played:
        yield played


@contextlib.contextmanager
def car_at(kind, store):
    line = PseudoTerminal() if kind == "pty" else TcpPort("127.0.0.1", 0)
    with contextlib.closing(line), simulated_car(line, ImageStore(store), CLASSROOM):
        yield line.address


def refused(exit_code, action, port, **options):
    """The sentence of the error with ``exit_code`` that ``action`` raises: one line, without a word of Python's."""
    with pytest.raises(MotorcadeError) as raised:
        action(port, **options)
    assert raised.value.exit_code == exit_code
    sentence = str(raised.value)
    assert sentence.endswith((".", "?"))
    assert "\n" not in sentence
    assert "Err" not in sentence
    return sentence


@every_line
@pytest.mark.parametrize("image", [IMAGE, LARGEST], ids=["two words", "511 words"])
def test_a_simulated_car_takes_an_image_and_gives_it_back(kind, image, tmp_path, monkeypatch):
    # What follows an image at once the car skips.
    monkeypatch.setattr(talk, "SETTLE_MS", protocol.SILENCE_MS + 50)
    store = tmp_path / "store.image"
    sent = []
    with car_at(kind, store) as port:
        answer = upload(port, image=image, progress=sent.append)
        assert readback(port) == image
    assert answer.startswith(f"OK words={len(image) // 4} crc32=")
    assert sent == sorted(set(sent))
    assert sent[-1] == len(image)
    assert ImageStore(store).load() == image


@every_line
@pytest.mark.parametrize(
    ("before", "behind"),
    [
        (b"\xff~\x00\x80", b"\r\n"),
        (b"battery 97 %\nERROR\n", b"\n\xff\x00ERR"),
        (b"\n\n", b"\nrunning\nERR low battery\n"),
    ],
)
def test_a_good_answer_is_found_in_what_else_the_line_brings(car, before, behind):
    car.take(before + OK.strip() + behind)
    assert upload(car.port) == OK.decode().strip()


@pytest.mark.parametrize("kind", [PTY])
def test_what_was_on_the_line_before_is_no_answer(car):
    car.send(b"ERR cut off after 3 bytes\n")
    car.take(OK)
    assert upload(car.port) == OK.decode().strip()


@every_line
def test_without_verification_the_bytes_are_sent_and_nothing_is_promised(car):
    assert upload(car.port, verify=False) == "sent, not verified"
    assert car.receive(len(IMAGE)) == IMAGE


BAD_ANSWERS = {
    "checksum": (b"OK words=2 crc32=00000000\n", VERIFICATION, "Something else arrived"),
    "count": (b"OK words=3 crc32=fcf9a423\n", VERIFICATION, "Something else arrived"),
    "changed": (b"ERR the checksum is 0badcafe, fcf9a423 was announced\n", VERIFICATION, "0badcafe"),
    "ERR": (b"ERR the image could not be stored\n", REFUSED, "refused: the image could not be stored"),
    "noise in ERR": (b"ERR \x1b]0;owned\x07\xff\n", REFUSED, "refused: ?]0;owned??"),
    "half a line": (b"OK words=2 crc32=fcf9", NO_ANSWER, "no answer within"),
}
BAD_IMAGES = {
    "silent": (b"", NO_ANSWER, "no answer within"),
    "cut off": (IMAGE[:6], NO_ANSWER, "stopped after 6 bytes"),
    "ERR": (b"ERR nothing here\n", VERIFICATION, "nothing here"),
    "busy": (b"ERR busy with another uploader\n", PORT_BUSY, "busy with another uploader"),
    "bad word": (bytes.fromhex("01000000 64800001"), VERIFICATION, "parity is 1"),
}
BAD = [pytest.param(True, *bad, id=f"upload: {name}") for name, bad in BAD_ANSWERS.items()]
BAD += [pytest.param(False, *bad, id=f"readback: {name}") for name, bad in BAD_IMAGES.items()]


@every_line
@pytest.mark.parametrize(("uploads", "answer", "exit_code", "says"), BAD)
def test_a_bad_answer(car, monkeypatch, uploads, answer, exit_code, says):
    if exit_code == NO_ANSWER:
        # Long enough for a busy machine to bring what the car does send.
        give_up_after(monkeypatch, 200 if uploads else 500)
    if uploads:
        car.take(answer)
    else:
        car.answer(answer, to=READBACK_REQUEST)
    sentence = refused(exit_code, upload if uploads else readback, car.port)
    assert says in sentence
    # Whoever uploads asks the car what it holds now; who reads asks for no change.
    assert ("keeps the image that it had" in sentence) == uploads


FOREIGN = {
    "a sensor's sketch": (b"Distance: 23 cm\r\n" * 40, 'sends "Distance: 23 cm"'),
    "one line": (b"hello, this is no car\n", 'sends "hello, this is no car"'),
    "Python": (b"\r\nMicroPython v1.28.0 on 2026-01-01\r\n>>> ", "the prompt of Python"),
    "a printer": (b"start\necho:Marlin 2.1\nError:Unknown command\n", "3D printer"),
    "a GPS receiver": (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M*47\r\n" * 9, "GPS"),
}


@every_line
@pytest.mark.parametrize("uploads", [True, False], ids=["upload", "readback"])
@pytest.mark.parametrize("name", FOREIGN)
def test_a_board_that_runs_something_else_is_told_by_what_it_sends(car, monkeypatch, uploads, name):
    sent, says = FOREIGN[name]
    monkeypatch.setattr(talk, "SETTLE_MS", 50)
    give_up_after(monkeypatch, 200)
    car.answer(sent, to=READBACK_REQUEST)
    sentence = refused(NO_ANSWER, upload if uploads else readback, car.port)
    assert says in sentence
    assert "no Motorcade car" in sentence
    # Nothing is known of an image, and a board that runs something else takes none unverified either.
    assert not any(word in sentence for word in ("image", "--no-verify", "cable"))


@pytest.mark.parametrize("heard", [b"", b"\xf3\x81~\x00" * 30, b"O? words=7 crc32=1c6a5f0e\n", b"\x00\x00\xff"])
def test_noise_and_damaged_answers_are_no_other_program(heard):
    assert talk.other_program(heard) is None


@every_line
def test_a_car_that_is_busy_is_not_asked_again(car):
    car.play(lambda: (car.receive(CHECK_BYTES), car.send(b"ERR busy with another uploader\n")))
    sentence = refused(PORT_BUSY, upload, car.port)
    assert "busy with another uploader" in sentence
    assert "image that it had" not in sentence


@every_line
def test_a_car_that_never_answers_is_sent_nothing_that_it_could_hold(car, monkeypatch):
    monkeypatch.setattr(talk, "CHECKED_WITHIN_MS", 200)
    sentence = refused(NO_ANSWER, upload, car.port)
    assert "no answer within" in sentence
    assert "keeps the image that it had" in sentence
    assert "--no-verify" in sentence
    requests = [car.receive(CHECK_BYTES) for _ in range(3)]
    assert {read_check(each)[0] for each in requests} == {0xFCF9A423}
    assert len(set(requests)) == 3


@every_line
def test_what_arrives_changed_is_sent_again_and_each_try_is_told(car):
    changed = b"ERR the checksum is 0badcafe, fcf9a423 was announced\n"
    told = []
    car.take(changed, changed, OK)
    assert upload(car.port, retrying=told.append) == OK.decode().strip()
    assert told == [Phrase(talk.SENDS_AGAIN, number=2, of=3), Phrase(talk.SENDS_AGAIN, number=3, of=3)]


@pytest.fixture
def left_sockets():
    """pyserial leaves a socket to the garbage collector where the other end has reset it."""
    yield
    gc.collect()


def hangs_up(test):
    return pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")(
        pytest.mark.usefixtures("left_sockets")(every_line(test))
    )


@hangs_up
@pytest.mark.parametrize(
    ("image", "says"),
    # The line has slack: this much is under way when the other end is gone.
    [(IMAGE, "holds the image that it had or the new one"), (LARGEST, "keeps the image that it had")],
    ids=["two words", "511 words"],
)
def test_a_car_that_goes_away_in_the_middle_of_an_upload(car, image, says):
    car.play(lambda: (car.get_ready(), car.receive(6), car.hang_up()))
    slow = 9600 if image is LARGEST else 115200
    sentence = refused(WENT_AWAY, serial_port.upload, car.port, image=image, baud=slow)
    assert "in the middle" in sentence
    assert ("cable" in sentence) == (not car.port.startswith("socket"))
    assert says in sentence


@hangs_up
def test_a_car_that_goes_away_in_the_middle_of_a_readback(car):
    car.play(lambda: (car.receive(4), car.send(IMAGE[:5]), car.hang_up()))
    sentence = refused(WENT_AWAY, readback, car.port)
    assert "in the middle" in sentence
    assert "image that it had" not in sentence


@pytest.mark.parametrize("kind", [PTY])
@pytest.mark.parametrize("moment", ["_reset_input_buffer", "write", "flush", "read"])
def test_a_car_that_goes_away_during_any_call_to_its_port(car, monkeypatch, moment):
    call = getattr(serial.Serial, moment)
    monkeypatch.setattr(serial.Serial, moment, lambda *arguments: (car.hang_up(), call(*arguments))[1])
    assert "went away" in refused(WENT_AWAY, upload, car.port)


@pytest.mark.parametrize("kind", [PTY])
def test_a_line_that_takes_no_bytes(car, monkeypatch):
    monkeypatch.setattr(serial_port, "_WRITE_TIMEOUT_S", 0.05)
    os.set_blocking(car.client, False)
    with contextlib.suppress(BlockingIOError):
        while os.write(car.client, bytes(1024)):
            pass
    assert "takes no more bytes" in refused(NO_ANSWER, upload, car.port)


@pytest.mark.parametrize(
    "port",
    ["/dev/there-is-none", "COM321", "socket://127.0.0.1:{free}", "127.0.0.1:{free}", "pigeon://home", ""],
)
def test_a_port_that_is_not_there(port):
    is_in_network = ":" in port
    with deaf_port() as free:
        port = port.format(free=free)
        for action in (upload, readback):
            sentence = refused(PORT_NOT_FOUND, action, port)
            assert port in sentence
            assert " ." not in sentence
            assert not (is_in_network and ("cable" in sentence or "USB" in sentence))


@POSIX_ONLY
def test_a_file_and_a_directory_are_no_ports(tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("mine")
    for port in (notes, tmp_path):
        assert "is no serial port" in refused(PORT_NOT_FOUND, upload, str(port))
    assert notes.read_text() == "mine"


@pytest.mark.parametrize("kind", [PTY])
def test_a_port_that_somebody_else_has_open_is_busy(car):
    with serial.Serial(car.port, exclusive=True):
        assert "is busy" in refused(PORT_BUSY, upload, car.port)
        assert "is busy" in refused(PORT_BUSY, readback, car.port)


@pytest.mark.parametrize(
    ("exit_code", "says", "problem"),
    [
        (PORT_NOT_FOUND, "There is no port", ["could not open port 'P': FileNotFoundError(2, 'No.', None, 2)"]),
        (PORT_BUSY, "close the other program", ["could not open port 'P': PermissionError(13, 'No.', None, 5)"]),
        (PORT_FORBIDDEN, "On Linux join the group", [13, "could not open port P: [Errno 13] Permission denied: 'P'"]),
        (PORT_BUSY, "close the other program", [16, "could not open port P: [Errno 16] Device busy: 'P'"]),
        *(
            (
                PORT_NOT_FOUND,
                f"Windows' error {number}, A device",
                [f"could not open port 'P': {kind}, None, {number})"],
            )
            for kind in ("PermissionError(13, 'A device failed.'", "OSError(22, 'A device failed.'")
            for number in (31, 87, 121, 1450)
        ),
        (PORT_NOT_FOUND, "the device or disk fails", [5, "could not open port P: [Errno 5] Input/output error: 'P'"]),
        (PORT_NOT_FOUND, "don't understand each other", [71, "could not open port P: [Errno 71] Protocol error: 'P'"]),
        (PORT_NOT_FOUND, "there is no such device", [19, "could not open port P: [Errno 19] No such device: 'P'"]),
        (PORT_NOT_FOUND, "doesn't permit it", [1, "could not open port P: [Errno 1] Operation not permitted: 'P'"]),
    ],
)
def test_what_the_system_says_about_a_port_becomes_a_sentence(monkeypatch, exit_code, says, problem):
    def fail(*arguments, **options):
        raise serial.SerialException(*problem)

    monkeypatch.setattr(serial, "serial_for_url", fail)
    assert says in refused(exit_code, upload, "P")
    assert says in refused(exit_code, readback, "P")


def test_a_port_that_is_listed_is_not_said_to_be_missing(monkeypatch):
    def fail(*arguments, **options):
        raise serial.SerialException(2, "could not open port P: [Errno 2] No such file or directory: 'P'")

    monkeypatch.setattr(serial, "serial_for_url", fail)
    assert "There is no port" in refused(PORT_NOT_FOUND, upload, "P")
    monkeypatch.setattr(serial_port.list_ports, "comports", lambda: [ListPortInfo("P", skip_link_detection=True)])
    assert "P is there but can't be opened" in refused(PORT_NOT_FOUND, upload, "P")


@pytest.mark.parametrize("kind", ["tcp"])
def test_an_address_is_taken_as_it_is_printed(car):
    car.take(OK)
    assert upload(car.port.removeprefix("socket://")) == OK.decode().strip()


@pytest.mark.parametrize("scheme", ["spy", "SPY", "alt", "hwgrep", "loop", "rfc2217", "cp2110", "file", "x y", ""])
def test_of_addresses_only_sockets_are_ports(scheme, tmp_path, monkeypatch):
    """pyserial would empty a file that `spy` names."""
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / "kept.txt"
    kept.write_text("mine", encoding="utf-8")
    for rest in (f"/dev/null?file={kept}", "", "127.0.0.1:9", f"socket://127.0.0.1:9?file={kept}"):
        refused(PORT_NOT_FOUND, upload, f"{scheme}://{rest}")
    assert [(file.name, file.read_text(encoding="utf-8")) for file in tmp_path.iterdir()] == [("kept.txt", "mine")]


@pytest.mark.parametrize(
    "address",
    [
        *("socket://127.0.0.1", "socket://127.0.0.1:9/?logging=debug", "socket://:9"),
        *("socket://[::1", "tcp:127.0.0.1:9", "1:2:3:4"),
    ],
)
def test_a_socket_is_a_host_and_a_port_and_nothing_else(address):
    with pytest.raises(MotorcadeError) as raised:
        upload(address)
    assert "HOST:PORT" in str(raised.value)


@POSIX_ONLY
def test_a_file_or_folder_is_no_port_and_is_not_opened(tmp_path):
    """Nobody reads the FIFO: to open it would wait for ever."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "fifo")
    for port in (*tmp_path.iterdir(), "/dev/null"):
        assert "is no serial port" in refused(PORT_NOT_FOUND, upload, str(port))


def test_only_one_place_opens_ports():
    """Whoever names a port has no other way to a device than the place that checks the name."""
    source = Path(serial_port.__file__).parents[1]
    found = {file.name for file in source.rglob("*.py") if "serial_for_url(" in file.read_text(encoding="utf-8")}
    assert found == {"serial_port.py"}


@pytest.mark.parametrize("port", ["COM3", "com12", r"\\.\COM12", "CNCA0"])
def test_on_windows_a_port_is_a_com_name_or_one_that_is_listed(port, monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(serial_port.list_ports, "comports", lambda: [ListPortInfo("CNCA0")])
    assert serial_port.port_name(f" {port}") == port
    for other in ("notes.txt", r"C:\COM3", "COM3.txt"):
        with pytest.raises(MotorcadeError, match="is no serial port"):
            serial_port.port_name(other)
