"""The one loop that every car runs, real or simulated: read the board, ask the brain, set the board.

Portable.
"""

from motorcade.car import brain
from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from motorcade.words.check import ready_line
from motorcade.words.image import bytes_to_words
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import later_ms
from motorcade.words.upload import CANT_STORE, CHECK, IMAGE, NO_PROGRAM, READBACK, CarEnd, CarEvent, error_line

_WHY_LOST = {brain.BAD_PARITY: "parity", brain.BAD_RESERVED: "reserved", brain.DEAF: "deaf"}


class Car:
    """A car on a `motorcade.car.board.Board`; call ``tick`` often, at best every few milliseconds.

    A car that was switched on with an image in its store begins it at its first tick.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.memory = [0] * brain.SIZE
        self.image: tuple[int, ...] = (0,)
        self._serial = CarEnd()
        self._wheels = brain.STILL
        self._led = brain.NO_LED
        self._is_on = False

    def tick(self) -> None:
        """Do all that is due at the board's present time."""
        board = self.board
        now = board.now_ms()
        if not self._is_on:
            self._switch_on(now)
        self._serve_serial(now)
        if board.is_leader:
            while brain.leader_step(self.memory, self.image, now, board.levels):
                self._note_state()
        else:
            self._follow(now)
        voice = board.heard_voice()
        if voice != brain.NO_VOICE:
            brain.hear_voice(self.memory, voice)
        self._act(now)
        self._send(now)

    def _switch_on(self, now: int) -> None:
        self._is_on = True
        brain.switch_on(self.memory, self.board.number, now)
        stored = self.board.load_image()
        if stored:
            self.image = bytes_to_words(stored)
        if self.board.is_leader:
            self._begin_program(now)

    def _begin_program(self, now: int) -> None:
        if brain.leader_start(self.memory, self.image, now):
            self._note_state()

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
        if self.board.is_leader:
            self._begin_program(now)

    def _follow(self, now: int) -> None:
        board, memory = self.board, self.memory
        if brain.follower_step(memory, now, board.levels):
            length = brain.length_ms(memory[brain.WORD], board.levels)
            board.note("over", later_ms(memory[brain.STARTED_MS], length), memory[brain.WORD], 0)
        for frame in board.received_frames():
            result = brain.follower_hears(memory, frame, now, board.levels)
            if result in _WHY_LOST:
                board.note("lost", now, frame, _WHY_LOST[result])
                continue
            board.note("heard", now, frame & 0xFFFFFFFE, 0)
            if result == brain.BEGUN:
                board.note("start", now, memory[brain.WORD], 0)

    def _act(self, now: int) -> None:
        board, memory = self.board, self.memory
        looks = brain.looks_mm(memory, now, board.levels)
        obstacle_mm = board.obstacle_mm() if looks else NOTHING_IN_SIGHT_MM
        wheels = brain.wheels(memory, obstacle_mm, board.sees_person(), now, board.levels)
        if wheels != self._wheels:
            self._wheels = wheels
            board.set_wheels(wheels >> 2, wheels & 3)
        led = brain.lit_led(memory, now, board.levels)
        if led != self._led:
            self._led = led
            board.set_led(led)

    def _send(self, now: int) -> None:
        board, memory = self.board, self.memory
        if board.is_leader:
            if not brain.leader_sends(memory, self.image, now, board.levels):
                return
            word = brain.sent_word(memory, self.image)
        else:
            busy = board.is_sending() or board.senses_carrier()
            if not brain.follower_sends(memory, busy, now, board.levels):
                return
            word = memory[brain.WORD]
        board.send_frame(to_frame(word))
        board.note("frame", now, word, 0)

    def _note_state(self) -> None:
        memory = self.memory
        self.board.note("state", memory[brain.STARTED_MS], memory[brain.WORD], memory[brain.STATE])
