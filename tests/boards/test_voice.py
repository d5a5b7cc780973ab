"""Voice sources: a keyboard, and a module on a UART with the file that lists its bytes."""

import threading
from pathlib import Path

import pytest

from motorcade.boards.computer import keyboard_voice
from motorcade.boards.on_chip.parts import SerialVoice
from motorcade.car.brain import NO_VOICE, VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, load_voice_map, parse_voice_map
from motorcade.errors import MotorcadeError
from support.waiting import DEADLINE_S

SHIPPED = Path(__file__).parents[2] / "firmware" / "linux" / "voice.toml"
HEAD = 'format = "motorcade-voice/1"\nbaud = 9600\n'
STOP = '[[word]]\nsays = "stop"\nbytes = "AA 01"\n'
PATTERNS = ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO), (b"halt\r\n", VOICE_STOP), (b"UU", VOICE_GO))


def heard(*chunks: bytes) -> list[int]:
    """Return the voices heard after each chunk of a module's bytes."""
    waiting = list(chunks)
    source = SerialVoice(lambda: waiting.pop(0), PATTERNS)
    return [source.heard_voice() for _ in chunks]


@pytest.mark.parametrize(
    ("chunks", "says"),
    [
        ([b"", b"\xaa\x01", b""], [NO_VOICE, VOICE_STOP, NO_VOICE]),
        ([b"\xaa", b"\x02"], [NO_VOICE, VOICE_GO]),
        ([b"ha", b"lt\r", b"\n"], [NO_VOICE, NO_VOICE, VOICE_STOP]),
        ([b"\x00\xff\xaa\xaa\x02\x99"], [VOICE_GO]),
        ([b"\xaa\x03\x01\x02"], [NO_VOICE]),
        # Where both words are heard, it is stop, in any order.
        ([b"\xaa\x01\xaa\x02"], [VOICE_STOP]),
        ([b"\xaa\x02\xaa\x01"], [VOICE_STOP]),
        ([b"\xaa\x02\xaa\x02"], [VOICE_GO]),
        # A byte belongs to one pattern.
        ([b"UU", b"U", b"U"], [VOICE_GO, NO_VOICE, VOICE_GO]),
    ],
)
def test_a_modules_bytes_become_words_in_chunks_of_any_size(chunks, says):
    assert heard(*chunks) == says


class Typist:
    """A keyboard whose lines come when the test types them."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._more = threading.Semaphore(0)
        self.taken = threading.Semaphore(0)

    def type(self, line: str) -> None:
        """Type a line, and wait until it was read."""
        self._lines.append(line)
        self._more.release()
        assert self.taken.acquire(timeout=DEADLINE_S)

    def __iter__(self):
        while True:
            self._more.acquire()
            yield self._lines.pop(0)
            self.taken.release()


@pytest.mark.parametrize(
    ("typed", "says"),
    [
        ([], NO_VOICE),
        (["stop\n"], VOICE_STOP),
        (["s\n"], VOICE_STOP),
        (["  GO \r\n"], VOICE_GO),
        (["g\n"], VOICE_GO),
        (["stopp\n", "\n", "oo\n", "a stop\n", "stop it\n"], NO_VOICE),
        (["go\n", "stop\n", "go\n"], VOICE_STOP),
    ],
)
def test_a_typed_word_is_heard_once(typed, says):
    typist = Typist()
    source = keyboard_voice(typist)
    for line in typed:
        typist.type(line)
    assert source.heard_voice() == says
    assert source.heard_voice() == NO_VOICE


def test_the_shipped_voice_map_is_valid():
    assert load_voice_map(SHIPPED) == VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO)))


def test_a_module_may_send_text_and_several_patterns_may_mean_one_word():
    text = HEAD + STOP + '[[word]]\nsays = "stop"\ntext = "停\\r\\n"\n[[word]]\nsays = "go"\nbytes = "ff"\n'
    expected = ((b"\xaa\x01", VOICE_STOP), ("停\r\n".encode(), VOICE_STOP), (b"\xff", VOICE_GO))
    assert parse_voice_map(text, "v.toml") == VoiceMap(9600, expected)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD, r"word is missing; give a list of 1 to 50, each a table {\.\.\.} of says, bytes, text"),
        (HEAD.replace("9600", "0") + STOP, "baud is 0; allowed"),
        (HEAD + '[[word]]\nsays = "halt"\nbytes = "01"\n', r'word\[0\].says is "halt"; allowed: "stop", "go"'),
        (HEAD + '[[word]]\nbytes = "01"\n', r'word\[0\].says is missing; give "stop", "go"'),
        (HEAD + '[[word]]\nsays = "go"\n', "word\\[0\\] needs one of bytes, text"),
        (HEAD + '[[word]]\nsays = "go"\nbytes = "01"\ntext = "go"\n', "has bytes, text; keep one of"),
        (HEAD + '[[word]]\nsays = "go"\nbytes = "AA 0"\n', 'bytes is "AA 0"; allowed: hexadecimal'),
        (HEAD + '[[word]]\nsays = "go"\nbytes = 12\n', "bytes is 12; allowed: hexadecimal"),
        (HEAD + '[[word]]\nsays = "go"\ntext = 12\n', "text is 12; allowed: text in quotation marks"),
        (HEAD + '[[word]]\nsays = "go"\nbytes = ""\n', "bytes has 0 bytes; allowed: 1 to 64"),
        (HEAD + STOP + '[[word]]\nsays = "go"\nbytes = "01"\n', "01 is part of AA 01, so the two can't be told apart"),
        (HEAD + STOP + STOP.replace("stop", "go"), "AA 01 is part of AA 01"),
    ],
)
def test_a_wrong_voice_map_is_refused_with_a_sentence(text, says):
    with pytest.raises(MotorcadeError, match=says):
        parse_voice_map(text, "v.toml")
