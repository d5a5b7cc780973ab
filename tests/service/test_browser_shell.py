"""The shell of the studio in a page's worker, with the engine of this computer and the test's clock."""

import json
from types import SimpleNamespace

import pytest

from motorcade.browser.shell import Shell
from motorcade.browser.storage import BrowserStorage
from support.pictures import Picture
from support.world_page import MAT, SET

KEY = "ab" * 16
# All transfers of a test together take less.
MOST_S = 60


class ShellClock:
    """Seconds, as the test sets them."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock():
    return ShellClock()


@pytest.fixture
def shell(clock):
    return Shell(BrowserStorage(), clock)


def ask(shell, name, message=None):
    return json.loads(shell.answer(name, json.dumps(message or {})))


def said(sent):
    """Texts as objects, and bytes as pictures."""
    return [json.loads(each) if isinstance(each, str) else Picture(each) for each in sent]


def test_a_wrong_request_is_refused_with_a_sentence_in_each_language(shell):
    for answer, code in (
        (shell.answer("example", '{"name": "none"}'), "no-example"),
        (shell.answer("example", "{"), "bad-message"),
        *((shell.refuse(why), f"browser-store-{why}") for why in ("full", "newer", "damaged")),
    ):
        error = json.loads(answer)["error"]
        assert (error["code"], set(error["sentence"])) == (code, {"en", "zh"})


def test_an_error_of_motorcade_itself_is_told_as_internal(shell, capsys):
    broken = Shell(None, lambda: 0.0, lambda *_: 1 / 0)  # type: ignore[arg-type,return-value]
    assert ask(broken, "projects/list")["error"]["code"] == "browser-fault"
    broken.open(1, "world", KEY)
    assert [each["code"] for each in said(broken.receive(1, json.dumps(SET)))] == ["browser-fault"]
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_a_world_plays_as_time_passes(shell, clock):
    assert [each["is"] for each in said(shell.open(1, "world", KEY))] == ["hello"]
    assert shell.wait_s(1) < 0
    assert [each["is"] for each in said(shell.receive(1, json.dumps(SET)))][:2] == ["hello", "state"]
    assert shell.wait_s(1) == 0
    first = next(each for each in said(shell.advance(1)) if isinstance(each, Picture))
    assert (first.number, first.cars) == (1, len(MAT["car"]))
    assert shell.wait_s(1) < 0
    shell.receive(1, '{"do": "play", "speed": 1}')
    times = []
    for _ in range(10):
        clock.now_s += shell.wait_s(1)
        times += [each.t_ms for each in said(shell.advance(1)) if isinstance(each, Picture)]
        shell.receive(1, '{"do": "shown", "frame": 99}')
    assert times == sorted(times)
    assert 200 < times[-1] <= 400


def test_a_world_stays_when_its_stream_is_opened_again(shell):
    shell.open(1, "world", KEY)
    shell.receive(1, json.dumps(SET))
    shell.close(1)
    assert shell.receive(1, '{"do": "pause"}') == []
    assert shell.wait_s(1) < 0
    hello = said(shell.open(2, "world", KEY))[0]
    assert (hello["resumed"], hello["cars"]) == (True, len(MAT["car"]))
    assert said(shell.open(3, "world", "cd" * 16))[0]["cars"] == 0


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ('{"do": "pause"}', "no-world"),
        ("{", "bad-message"),
        (b"bytes", "bad-message"),
        ('{"do": "fly"}', "bad-message"),
    ],
)
def test_a_wrong_message_is_refused_and_the_stream_stays(shell, message, code):
    shell.open(1, "world", KEY)
    assert [each["code"] for each in said(shell.receive(1, message))] == [code]
    assert said(shell.receive(1, json.dumps(SET)))[0]["is"] == "hello"


@pytest.mark.parametrize("message", ["{", b"bytes", "{}", '{"image": "AAAA"}'])
def test_a_wrong_order_fails_and_ends(shell, message):
    shell.open(1, "serial", "")
    assert [each["outcome"] for each in said(shell.receive(1, message))] == ["failed"]
    assert shell.wait_s(1) < 0


def transfer(shell, clock, number, order):
    """Do one transfer with the virtual car; return the page's messages."""
    sent = shell.open(number, "upload", "")
    sent += shell.receive(number, json.dumps(order))
    while (wait_s := shell.wait_s(number)) >= 0:
        clock.now_s += max(wait_s, 0.001)
        assert clock.now_s < MOST_S, "it has ended"
        sent += shell.advance(number)
    shell.close(number)
    return [json.loads(each) for each in sent]


def test_the_virtual_car_keeps_what_was_uploaded(shell, clock):
    assert ask(shell, "capabilities")["answer"]["most_cars"] > 0
    assert [port["port"] for port in ask(shell, "ports")["answer"]] == ["virtual"]
    blocks = {name: ask(shell, "example", {"name": "square"})["answer"][name] for name in ("leader", "followers")}
    image = ask(shell, "compile", blocks)["answer"]["image"]
    empty = {"outcome": "image", "image": "AAAAAA=="}
    assert transfer(shell, clock, 1, {"port": "virtual", "readback": True}) == [empty]
    *progress, outcome = transfer(shell, clock, 2, {"port": "virtual", "image": image})
    assert outcome["outcome"] == "verified"
    assert progress[-1]["sent"] == progress[-1]["of"]
    assert shell.storage.take_car_image() == image
    assert transfer(shell, clock, 3, {"port": "virtual", "readback": True}) == [{"outcome": "image", "image": image}]
    (refused,) = transfer(shell, clock, 4, {"port": "COM1", "readback": True})
    assert refused["error"]["code"] == "no-such-port"
    (refused,) = transfer(shell, clock, 5, {"port": "virtual", "image": "AAAA"})
    assert refused["outcome"] == "failed"


def test_bytes_of_the_pages_port_reach_the_transfer(shell, clock):
    number, image, messages = 1, bytes.fromhex("0100000065800000"), []
    # As Pyodide passes bytes to Python.
    array = SimpleNamespace(to_bytes=lambda: image)
    shell.open(number, "serial", "")
    sent = shell.receive(number, json.dumps({"readback": True}))
    while (wait_s := shell.wait_s(number)) >= 0:
        clock.now_s += max(wait_s, 0.001)
        for each in sent:
            messages += [] if isinstance(each, bytes) else [json.loads(each)]
        asked = any(isinstance(each, bytes) for each in sent)
        sent = shell.receive(number, array) if asked else shell.advance(number)
    messages += [json.loads(each) for each in sent if isinstance(each, str)]
    assert [message["outcome"] for message in messages] == ["image"]
