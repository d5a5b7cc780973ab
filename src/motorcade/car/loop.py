"""The loop of every car with a board, real or simulated: serve the serial line, then do one step.

Portable.
"""

from motorcade.car import brain, frames, step
from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from motorcade.words.check import ready_line
from motorcade.words.image import bytes_to_words
from motorcade.words.upload import CANT_STORE, CHECK, IMAGE, NO_PROGRAM, READBACK, CarEnd, CarEvent, error_line

_ALL_BUT_PARITY = 0xFFFFFFFE
_KINDS = ("state", "start", "over")  # at the indices of motorcade.car.step
_LOSS_REASONS = {
    frames.BAD_PARITY: "parity",
    frames.BAD_RESERVED: "reserved",
    frames.BAD_CHECK: "check",
    frames.DEAF: "deaf",
}


class Car:
    """A car on a `motorcade.car.board.Board`; call ``tick`` often, at best every few milliseconds.

    A car that was switched on with an image in its store begins it at its first tick.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.memory = [0] * brain.SIZE
        self.image: tuple[int, ...] = (0,)
        self._serial = CarEnd(board.most_words, board.words_a_tick)
        self._wheels = brain.STILL
        self._led = brain.NO_LED
        self._is_on = False
        self._now_ms = 0

    def tick(self) -> None:
        """Do all that is due at the board's present time."""
        self._now_ms = now = self.board.now_ms()
        if not self._is_on:
            self._switch_on(now)
        self._serve_serial(now)
        step.step(self, now)

    def _switch_on(self, now: int) -> None:
        self._is_on = True
        brain.switch_on(self.memory, self.board.number, now)
        stored = self.board.load_image()
        if stored:
            self.image = bytes_to_words(stored)
        if self.leads:
            step.begin_program(self, now)

    def _serve_serial(self, now: int) -> None:
        board = self.board
        self._serial.receive_data(board.read_serial(), now)
        event = self._serial.next_event()
        while event is not None:
            if event.kind == READBACK:
                board.write_serial(board.load_image() or NO_PROGRAM)
            elif event.kind == CHECK:
                board.write_serial(ready_line(event.answer, board.load_image() or NO_PROGRAM))
            elif event.kind == IMAGE:
                self._take_image(event, now)
            else:
                board.write_serial(event.answer)
            event = self._serial.next_event()

    def _take_image(self, event: CarEvent, now: int) -> None:
        try:
            self.board.store_image(event.image)
        except OSError:
            self.board.write_serial(error_line(CANT_STORE))
            return
        self.board.write_serial(event.answer)
        self.board.note("image", now, len(event.image), 0)
        self.image = bytes_to_words(event.image)
        if self.leads:
            step.begin_program(self, now)

    # What motorcade.car.step uses.

    @property
    def leads(self) -> bool:
        """Whether the car leads or follows."""
        return self.board.is_leader

    @property
    def levels(self) -> tuple[int, ...]:
        """The profile's integers."""
        return self.board.levels

    def note(self, kind: int, at_ms: int, word: int, detail: int) -> None:
        """Report to the board that a state or a word begins, or that a word is over."""
        self.board.note(_KINDS[kind], at_ms, word, detail)

    def received_frames(self) -> list[int] | tuple[int, ...]:
        """The frames that ended since the last tick."""
        return self.board.received_frames()

    def note_frame(self, frame: int, result: int) -> None:
        """Report to the board whether a frame was received or lost."""
        if result in _LOSS_REASONS:
            self.board.note("lost", self._now_ms, frame, _LOSS_REASONS[result])
        else:
            self.board.note("heard", self._now_ms, frame & _ALL_BUT_PARITY, 0)

    def heard_voice(self) -> int:
        """The voice command since the last tick."""
        return self.board.heard_voice()

    def sense(self, looks_mm: int) -> tuple[int, bool]:
        """The distance of the nearest obstacle in mm, and whether a person is near."""
        obstacle_mm = self.board.obstacle_mm() if looks_mm else NOTHING_IN_SIGHT_MM
        return obstacle_mm, self.board.sees_person()

    def set_outputs(self, wheels: int, senses: tuple[int, bool]) -> None:
        """Set wheels and LED where they change."""
        if wheels != self._wheels:
            self._wheels = wheels
            self.board.set_wheels(wheels >> 2, wheels & 3)
        led = brain.lit_led(self.memory, self._now_ms, self.levels)
        if led != self._led:
            self._led = led
            self.board.set_led(led)

    def air_is_busy(self) -> bool:
        """Whether infrared of any car, this one included, is on the air here."""
        return self.board.is_sending() or self.board.senses_carrier()

    def send_frame(self, frame: int) -> None:
        """Begin to send ``frame`` by infrared."""
        self.board.send_frame(frame)
        self.board.note("frame", self._now_ms, frame & _ALL_BUT_PARITY, 0)
