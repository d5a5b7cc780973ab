"""What a board on a simulated chip did to its pins, for check_board. Portable."""

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import UNIT_US
from motorcade.car.check import BoardObserver
from motorcade.words.infrared import FrameReceiver


class ChipObserver(BoardObserver):
    """Looks at the pins of a bench (driven_car.Bench), and moves things before its sensors."""

    def __init__(self, bench):
        self._bench = bench
        self._pins = bench.pins
        self._receiver = FrameReceiver(bench.settings["levels"][UNIT_US])
        self._written = b""
        bench.chip.listeners.append(self._take)

    def wheels(self):
        return self._bench.observed.power("left_motor"), self._bench.observed.power("right_motor")

    def lit_leds(self):
        return self._bench.observed.lit_leds()

    def sent_frames(self):
        frames = []
        frame = self._receiver.next_frame()
        while frame is not None:
            frames.append(frame)
            frame = self._receiver.next_frame()
        return frames

    def written_bytes(self):
        data, self._written = self._written, b""
        return data

    def put_obstacle(self, distance_mm):
        self._bench.sonar.distance_mm = None if distance_mm == NOTHING_IN_SIGHT_MM else distance_mm
        return distance_mm

    def show_carrier(self, is_on):
        self._bench.chip.set_input(self._pins["infrared"]["receiver"], 0 if is_on else 1)
        # A leader receives nothing.
        return not self._bench.settings["is_leader"]

    def show_person(self, is_there):
        self._bench.chip.set_input(self._pins["pir"]["output"], 1 if is_there else 0)
        return True

    def show_floor(self, dark):
        for place, role in enumerate(("left", "right")):
            self._bench.chip.set_input(self._pins["floor"][role], dark >> place & 1)
        return True

    def speak(self, voice):
        settings = self._bench.settings.get("voice")
        if settings is None:
            return False
        for pattern, meant in settings["patterns"]:
            if meant == voice:
                self._bench.machine.uarts[self._pins["voice"]["receive"]].arrive(bytes.fromhex(pattern))
        return True

    def cut_power(self):
        self._bench.flash.lose()

    def _take(self, what, pin, value):
        if what == "bytes":
            self._written += value
        if what == "infrared":
            for place, duration_us in enumerate(value):
                if place % 2:
                    self._receiver.receive_space(duration_us)
                else:
                    self._receiver.receive_mark(duration_us)
