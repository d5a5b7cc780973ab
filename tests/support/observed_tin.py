"""The tin of `support.tin_car` with every part, and its observer."""

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.check.checked_board import BoardObserver
from support.tin_car import Tin, TinBoard

SPACE_S = 0.005


class TinBench(Tin):
    """The hardware with sensors. A command may come late; then only the observer sees when it is done."""

    def __init__(self):
        super().__init__()
        self.timed = []
        self.distance_mm = None
        self.person = False
        self.floor = 0
        self.spoken = []
        self.carrier = False
        self.carrier_until_s = 0.0
        self.eeprom = None
        self.cache = None

    def command(self, text, delay_s=0.0):
        super().command(text)
        self.timed.append((self.now_s + delay_s, text))

    def done(self, *kinds):
        """The arguments of all commands of these kinds that are done by now, in the order of their times."""
        due = sorted((at_s, place) for place, (at_s, _) in enumerate(self.timed) if at_s <= self.now_s)
        texts = [self.timed[place][1].split() for _, place in due]
        return [text[1:] for text in texts if text[0] in kinds]


class TinObserver(BoardObserver):
    """What a TinBench did, and hands that move things before its sensors."""

    def __init__(self, bench, has_sensors=True):
        self.bench = bench
        self.frames_seen = 0
        self.has_sensors = has_sensors

    def wheels(self):
        return tuple(map(float, (self.bench.done("GO") or [(0, 0)])[-1]))

    def lit_leds(self):
        return [int(led) for led in (self.bench.done("LIGHT", "DARK") or [()])[-1]]

    def sent_frames(self):
        sent = self.bench.done("SEND")
        new, self.frames_seen = sent[self.frames_seen :], len(sent)
        return [int(frame, 16) for (frame,) in new]

    def written_bytes(self):
        data, self.bench.line_out = self.bench.line_out, b""
        return data

    def put_obstacle(self, distance_mm):
        self.bench.distance_mm = None if distance_mm == NOTHING_IN_SIGHT_MM else distance_mm
        return distance_mm

    def show_carrier(self, is_on):
        if self.bench.carrier and not is_on:
            self.bench.carrier_until_s = self.bench.now_s + SPACE_S
        self.bench.carrier = is_on
        return self.has_sensors

    def show_person(self, is_there):
        self.bench.person = is_there
        return self.has_sensors

    def show_floor(self, dark):
        self.bench.floor = dark
        return self.has_sensors

    def speak(self, voice):
        self.bench.spoken.append(voice)
        return self.has_sensors

    def cut_power(self):
        self.bench.cache = self.bench.eeprom


class FullTin(TinBoard):
    """A correct board for all of a TinBench."""

    def senses_carrier(self):
        return self.tin.carrier or self.tin.now_s < self.tin.carrier_until_s

    def obstacle_mm(self):
        return NOTHING_IN_SIGHT_MM if self.tin.distance_mm is None else self.tin.distance_mm

    def sees_person(self):
        return self.tin.person

    def dark_floor(self):
        return self.tin.floor

    def heard_voice(self):
        return self.tin.spoken.pop(0) if self.tin.spoken else 0


class EepromTin(FullTin):
    """A correct board whose store is no file: a page of an EEPROM, written for good by a command of its own."""

    def load_image(self):
        return self.tin.cache

    def store_image(self, data):
        self.tin.cache = data
        self.tin.eeprom = data
