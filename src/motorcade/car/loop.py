"""The loop of every car with a board, real or simulated: serve the serial line, then do one step.

Portable.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from collections.abc import Sequence

from array import array

from motorcade.car import brain, decisions, frames, next_wakeup, step
from motorcade.car.board import Board
from motorcade.car.senses import Senses
from motorcade.words.packing import WORD_BYTES, bytes_to_words
from motorcade.words.receiver import MOST_WORDS
from motorcade.words.request import (
    BLINK,
    BLINK_MS,
    GO,
    KEEPS_NO_NAME,
    NAME,
    REQUEST_KINDS,
    STOP,
    answer_line,
    checksum_text,
    is_car_name,
    read_request,
    ready_line,
)
from motorcade.words.ticks import elapsed_ms, later_ms, reached
from motorcade.words.upload import (
    CANT_STORE,
    CHANGED_REQUEST,
    CHECK,
    IMAGE,
    NO_PROGRAM,
    READBACK,
    REQUEST,
    CarEnd,
    CarEvent,
    error_line,
)

# On a slow chip: how many words of a new image one tick takes, and how often the brain runs while it watches for
# obstacles or people. It allocates memory each time.
_WORDS_A_TICK = 48
_WATCH_MS = 10
# Storing stops a slow chip for 70 ms, for 0.5 s at the longest: a follower does it where the air has been free for as
# long as this, and at the latest so long after the image came. The uploader waits 2 s for the answer.
_QUIET_MS = 100
_STORE_WITHIN_MS = 500
_ALL_BUT_PARITY = 0xFFFFFFFE
# A car that blinks lights one LED after the other, so it needs only one of them: so long each, and none after the last.
_LED_MS = 100
_KINDS = ("state", "start", "over")  # at the indices of motorcade.car.step
_LOSS_REASONS = {
    frames.BAD_PARITY: "parity",
    frames.BAD_RESERVED: "reserved",
    frames.BAD_CHECK: "check",
    frames.REMOTE: "remote",
    frames.DEAF: "deaf",
}


class Car:
    """A car on a `motorcade.car.board.Board`; call ``tick`` often, at best every few milliseconds.

    A car that was switched on with an image in its store begins it at its first tick.

    On a slow chip (``board.words_a_tick`` below 511) a tick does either one piece of the work that uploads make, or all
    else; where there is much of that work, each second tick is for all else. An image begins some ticks later there.
    It is stored while the wheels stand and nothing is on the air: a leader stops for it, and a follower waits up to
    0.5 s for such a moment before it stops. The frames of a leader that decides begin in the tick after its words.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.leads, self.levels = board.is_leader, board.levels
        self.memory = [0] * brain.SIZE
        self.decisions = bytearray(decisions.SIZE if self.leads else 0)
        self.image: Sequence[int] = (0,)
        self._serial = CarEnd(board.most_words, board.words_a_tick)
        # The bytes of the stored image, so that no tick has to read the store, and answers that aren't sent yet.
        self._stored = NO_PROGRAM
        self._answers = b""
        self._is_slow = board.words_a_tick < MOST_WORDS
        self._has_worked = False
        # The words of a new image that doesn't run yet: as many as were taken so far. None where no image is new.
        self._words: array[int] | None = None
        # What is found out about them meanwhile, for `motorcade.car.decisions`.
        self._surveyed = bytearray(0)
        # A new image that isn't stored yet, when it came, and since when the air has been free.
        self._unstored: CarEvent | None = None
        self._came_ms = self._free_since_ms = 0
        # Whether the board waits for such a moment, too.
        self._rests = False
        self._wheels, self._led = brain.STILL, brain.NO_LED
        # Whether the LED blinks, since when, and which one is lit then.
        self._blinks = False
        self._blinks_since_ms = 0
        self._blinking_led = brain.NO_LED
        # Whether a request stopped the car: its brain then rests until another lets it go.
        self._is_stopped = False
        self._sender = board.sender
        # A method that is looked up is a new object each time.
        self._answering = self._answer
        self._is_on = False
        self._is_sending = False
        self._now_ms = 0
        self._wake_ms = 0
        # Whether the brain has acted, and the frame that is due is to begin.
        self._sends_next = False
        self._frames: list[int] | tuple[int, ...] = ()
        self._voice = brain.NO_VOICE

    def tick(self) -> None:
        """Do all that is due at the board's present time."""
        board = self.board
        self._now_ms = now = board.now_ms()
        if not self._is_on:
            self._switch_on(now)
        if self._blinks:
            self._blink(now)
        if self._has_worked:
            self._has_worked = False
        elif self._work(now):
            self._has_worked = True
            return
        if not self.leads:
            self._frames = board.received_frames()
        self._voice = board.heard_voice()
        if self._is_sending:
            # Ask also while there is nothing to send: boards compare times that wrap.
            self._is_sending = board.is_sending()
        if self._is_stopped:
            return
        hears = self._frames or self._voice != brain.NO_VOICE
        if hears or (not self._sends_next and reached(now, self._wake_ms)):
            step.act(self, now)
            self._sends_next = True
            if self._is_slow and self.leads and decisions.decides(self.decisions):
                return
        if self._sends_next:
            self._sends_next = False
            step.send(self, now)
            self._wake_ms = later_ms(now, self._rest_ms(now))

    def _rest_ms(self, now: int) -> int:
        """Return for how many ms the brain need not run, unless a frame, a voice or a new image comes."""
        s, levels = self.memory, self.levels
        decides = self.leads and decisions.decides(self.decisions)
        if (decides and decisions.watches(s, self.decisions)) or brain.watches(s, now, levels):
            return _WATCH_MS if self._is_slow else 0
        rest_ms = next_wakeup.word_rest_ms(s, now, levels)
        if rest_ms > 1:
            # When the air will be free isn't known: a car that waits for that asks in every tick.
            if self.leads and self.decisions[decisions.TELLS]:
                sends_ms = next_wakeup.tells_rest_ms(s, self.decisions, self.image, 0, now, levels)
            elif self.leads:
                sends_ms = next_wakeup.frames_rest_ms(s, self.image, 0, now, levels)
            else:
                sends_ms = next_wakeup.relay_rest_ms(s, 0, now)
            if sends_ms < rest_ms:
                rest_ms = sends_ms
        return rest_ms

    def _switch_on(self, now: int) -> None:
        self._is_on = True
        self._wake_ms = now
        brain.switch_on(self.memory, self.board.number, now)
        self._stored = self.board.load_image() or NO_PROGRAM
        self._take_words(now)

    def _work(self, now: int) -> bool:
        """Answer requests, serve the serial line, or go on with a new image.

        Return whether all else has to wait for the next tick.
        """
        if self.board.answer_requests(self._answering) and self._is_slow:
            return True
        if self._words is not None:
            self._take_more_words(self._words, now)
            return True
        if self._unstored is not None:
            return self._store_at_rest(self._unstored, now)
        takes_long = self._serve_serial(now)
        if self._answers:
            self.board.write_serial(self._answers[: self.board.bytes_a_tick])
            self._answers = self._answers[self.board.bytes_a_tick :]
        elif self._is_slow and not takes_long and self.board.needs_rest():
            return self._work_at_rest(now)
        return takes_long

    def _serve_serial(self, now: int) -> bool:
        if self._sender != self.board.sender:
            self._sender = self.board.sender
            self._serial = CarEnd(self.board.most_words, self.board.words_a_tick)
            self._answers = b""
        if not self._is_slow:
            self._serial.receive_data(self.board.read_serial(), now)
            while self._take_event(now):
                pass
            return False
        # Answers that wait hold events back, and those hold bytes back: neither can fill the memory.
        if self._answers:
            return False
        if self._take_event(now):
            return True
        data = self.board.read_serial()
        return self._serial.receive_data(data, now) or bool(data)

    def _take_event(self, now: int) -> bool:
        """Do what the next event of the serial line asks for; return whether there was one."""
        event = self._serial.next_event()
        if event is None:
            return False
        if event.kind == READBACK:
            self._answers += self._stored
        elif event.kind == CHECK:
            self._answers += ready_line(event.answer, self._stored)
        elif event.kind == REQUEST:
            self._answers += self._answer(event.image)
        elif event.kind == IMAGE and self._is_slow:
            self._unstored = event
            self._came_ms = self._free_since_ms = now
        elif event.kind == IMAGE:
            self._take_image(event, now)
        else:
            self._answers += event.answer
        return True

    def _answer(self, data: bytes) -> bytes:
        """Do what the request in ``data`` asks for, and return the answer."""
        request, now, board = read_request(data), self._now_ms, self.board
        if request is None:
            return error_line(f"{CHANGED_REQUEST} on the way")
        if request.kind not in REQUEST_KINDS:
            return error_line(f"request-unknown kind={request.kind}")
        if request.kind == NAME:
            try:
                if not is_car_name(request.name):
                    return error_line("name-refused")
                self._stand(now)
                board.store_name(request.name)
            except OSError:
                return error_line(KEEPS_NO_NAME)
        elif request.kind == BLINK:
            self._blinks, self._blinks_since_ms = True, now
        elif request.kind == STOP and not self._is_stopped:
            self._is_stopped = True
            self._wheels, self._led = brain.STILL, brain.NO_LED
            board.set_wheels(0, 0)
            board.set_led(brain.NO_LED)
        elif request.kind == GO and self._is_stopped:
            self._is_stopped = False
            self._wake_ms = now
            if self.leads and self._words is None:
                step.begin_program(self, now)
        return answer_line(request, self._fields())

    def _fields(self) -> "tuple[tuple[str, str], ...]":
        """What a car tells about itself: the fields of its answers to requests."""
        board = self.board
        try:
            battery_mv = board.battery_mv()
        except OSError:
            battery_mv = None
        return (
            ("holds", checksum_text(self._stored)),
            ("words", str(len(self._stored) // WORD_BYTES)),
            ("number", f"{board.number:08x}"),
            ("role", "leader" if self.leads else "follower"),
            ("state", "stopped" if self._is_stopped else "runs"),
            ("board", board.kind),
            ("version", board.version),
            ("battery", "" if battery_mv is None else str(battery_mv)),
            ("name", board.name),
        )

    def _blink(self, now: int) -> None:
        """Light one LED after the other; at the end the one that the program lights."""
        blinked_ms = elapsed_ms(now, self._blinks_since_ms)
        self._blinks = blinked_ms < BLINK_MS
        led = blinked_ms // _LED_MS % (brain.NO_LED + 1) if self._blinks else self._led
        if led != self._blinking_led or not self._blinks:
            self._blinking_led = led
            self.board.set_led(led)

    def _store_at_rest(self, event: CarEvent, now: int) -> bool:
        """Store a new image if this is the moment for it, with the wheels at rest; return whether it was."""
        # The program that a leader leaves is over.
        if not self._is_at_rest(now, True):
            return False
        self._unstored = None
        self._take_image(event, now)
        return True

    def _work_at_rest(self, now: int) -> bool:
        """Let the board do work that takes long if this is the moment for it; return whether it was."""
        if not self._rests:
            self._rests, self._came_ms, self._free_since_ms = True, now, now
        if not self._is_at_rest(now, self._wheels & 3 == 0):
            return False
        self._rests = False
        self.board.work_at_rest()
        return True

    def _is_at_rest(self, now: int, may_stop: bool) -> bool:
        """Stop the wheels if this is the moment for it; return whether it is. A leader waits unless it ``may_stop``."""
        if is_busy := self.air_is_busy():
            self._free_since_ms = now
        drives = self._wheels & 3 > 0
        stands_in_silence = not drives and elapsed_ms(now, self._free_since_ms) >= _QUIET_MS
        # A leader hears nothing.
        is_moment = not is_busy and may_stop if self.leads else stands_in_silence
        if not is_moment and elapsed_ms(now, self._came_ms) < _STORE_WITHIN_MS:
            return False
        self._stand(now)
        return True

    def _stand(self, now: int) -> None:
        """Stop the wheels before something is stored, which may take seconds; a word that isn't over drives on then."""
        if self._wheels & 3:
            self._wheels = brain.STILL
            self.board.set_wheels(0, 0)
        self._wake_ms = now

    def _take_image(self, event: CarEvent, now: int) -> None:
        self._stand(now)
        try:
            self.board.store_image(event.image)
        except OSError:
            self._answers += error_line(CANT_STORE)
            return
        self._answers += event.answer
        self._stored = event.image
        self.board.note("image", now, len(event.image), 0)
        self._take_words(now)

    def _take_words(self, now: int) -> None:
        """Begin the stored image; on a slow chip, begin to take its words. A follower uses none of them."""
        if not self.leads:
            return
        # The image that runs needs its own until then.
        self._surveyed = bytearray(decisions.SIZE)
        if self._is_slow:
            # Words in an array are no objects: collecting garbage takes less time.
            self._words = array("I")
        else:
            words = bytes_to_words(self._stored)
            decisions.survey(self._surveyed, words, 0, len(words), self.levels)
            self._begin(words, now)

    def _take_more_words(self, words: "array[int]", now: int) -> None:
        """Take some of a new image's words, or begin it: each takes a slow chip some milliseconds."""
        at = len(words) * WORD_BYTES
        if at < len(self._stored):
            seen = len(words)
            words.extend(array("I", bytes_to_words(self._stored[at : at + _WORDS_A_TICK * WORD_BYTES])))
            decisions.survey(self._surveyed, words, seen, len(words), self.levels)
        else:
            self._words = None
            self._begin(words, now)

    def _begin(self, words: "Sequence[int]", now: int) -> None:
        self.image = words
        self.decisions = self._surveyed
        self._wake_ms = now
        if not self._is_stopped:
            step.begin_program(self, now)

    # What motorcade.car.step uses.

    def note(self, kind: int, at_ms: int, word: int, detail: int) -> None:
        """Report to the board that a state or a word begins, or that a word is over."""
        self.board.note(_KINDS[kind], at_ms, word, detail)

    # The states that begin say enough of a real car.
    notes_flow = 0

    def note_end(self) -> None:
        """Tell nobody."""

    def note_flow(self, index: int) -> None:
        """Tell nobody."""

    def received_frames(self) -> list[int] | tuple[int, ...]:
        """The frames that ended since the last tick."""
        return self._frames

    def note_frame(self, frame: int, result: int) -> None:
        """Report to the board whether a frame was received or lost."""
        if result in _LOSS_REASONS:
            self.board.note("lost", self._now_ms, frame, _LOSS_REASONS[result])
        else:
            self.board.note("heard", self._now_ms, frame & _ALL_BUT_PARITY, 0)

    def heard_voice(self) -> int:
        """The voice command since the last tick."""
        return self._voice

    def sense(self, looks_mm: int) -> Senses:
        """What the sensors tell."""
        return self.board.senses(looks_mm)

    def set_outputs(self, wheels: int, senses: Senses) -> None:
        """Set wheels and LED where they change."""
        if wheels != self._wheels:
            self._wheels = wheels
            self.board.set_wheels(wheels >> 2, wheels & 3)
        led = brain.lit_led(self.memory, self._now_ms, self.levels)
        if led != self._led:
            self._led = led
            if not self._blinks:
                self.board.set_led(led)

    def air_is_busy(self) -> bool:
        """Whether infrared of any car, this one included, is on the air here."""
        return self.board.is_sending() or self.board.senses_carrier()

    def send_frame(self, frame: int) -> None:
        """Begin to send ``frame`` by infrared."""
        self.board.send_frame(frame)
        self._is_sending = True
        self.board.note("frame", self._now_ms, frame & _ALL_BUT_PARITY, 0)
