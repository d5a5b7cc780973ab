"""Boards that break the contract, each in one way, and part of the sentence that check_board gives."""

import time
from typing import Any

from motorcade.car.board import Board
from support.tin_car import RealClock, TinBoard


class NotWrapped(TinBoard):
    def now_ms(self):
        return int((self.tin.now_s + 1.7e9) * 1000)


class WrapsInTwelveDays(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1000)


class WrapsTooSoon(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1000) & 0xFFFFFFF


class GoesBack(TinBoard):
    def now_ms(self):
        self.tin.now_s -= 0.01
        return super().now_ms()


class StandsStill(TinBoard):
    def now_ms(self):
        return 5


class FloatClock(TinBoard):
    def now_ms(self):
        return self.tin.now_s * 1000 % 2**30


class MicrosecondClock(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1_000_000) & 0x3FFFFFFF


class NoClock(Board):
    levels = TinBoard.levels

    def __init__(self, tin, folder):
        pass


class NotDerived:
    number, is_leader, levels = 0, False, TinBoard.levels

    def __init__(self, tin, folder):
        self.board = TinBoard(tin, folder)
        for name in ("now_ms", "load_image", "store_image", "read_serial", "write_serial", "received_frames"):
            setattr(self, name, getattr(self.board, name))


class BadLevels(TinBoard):
    levels = (0, 1000, 2000, 3000)


class ShuffledLevels(TinBoard):
    levels = TinBoard.levels[::-1]


class BadNumber(TinBoard):
    number = -1


class BadRole(TinBoard):
    is_leader: Any = "leader"


class FramesStay(TinBoard):
    def received_frames(self):
        return self.tin.to_report


class FramesChecked(TinBoard):
    def received_frames(self):
        return [frame for frame in super().received_frames() if frame.bit_count() % 2 == 0]


class FramesAsText(TinBoard):
    def received_frames(self):
        return [f"{frame:08X}" for frame in super().received_frames()] + ["A4A80000"]


class NoFramesAtAll(TinBoard):
    def received_frames(self):
        return None


class DeafToMost(TinBoard):
    def received_frames(self):
        super().received_frames()
        return ()


class LineAsText(TinBoard):
    def read_serial(self):
        return super().read_serial().decode()


class LineStays(TinBoard):
    def read_serial(self):
        return self.tin.line_in


class LineWaits(TinBoard):
    def read_serial(self):
        self.tin.now_s += 0.5
        return super().read_serial()


class WheelsOfThreeSpeeds(TinBoard):
    def set_wheels(self, direction, speed_level):
        super().set_wheels(direction, [0, 1, 2].index(speed_level))


class WheelsByOne(TinBoard):
    def set_wheels(self, direction):
        pass


class NoDarkness(TinBoard):
    def set_led(self, which):
        (10, 11, 12, 13)[which]


class SendsAndWaits(TinBoard):
    def send_frame(self, frame):
        super().send_frame(frame)
        self.tin.now_s += FRAME_ON_AIR_S

    def is_sending(self):
        return False


class NeverSending(TinBoard):
    def is_sending(self):
        return False


class SendsForEver(TinBoard):
    def is_sending(self):
        return self.tin.busy_until_s > 0


class SendsTooShort(TinBoard):
    def is_sending(self):
        return self.tin.now_s < self.tin.busy_until_s - 0.06


class HearsItself(TinBoard):
    def send_frame(self, frame):
        super().send_frame(frame)
        self.tin.to_report.append(frame)


class NoDistance(TinBoard):
    def obstacle_mm(self):
        return None


class FarInMetres(TinBoard):
    def obstacle_mm(self):
        return 1.5


class SaysWords(TinBoard):
    def heard_voice(self):
        return "stop"


class SaysItAgain(TinBoard):
    def heard_voice(self):
        return 1


class PersonByVolts(TinBoard):
    def sees_person(self):
        return 1023


class SensorUnplugged(TinBoard):
    def sees_person(self):
        raise RuntimeError("no PIR at pin 7")


class Forgets(TinBoard):
    def store_image(self, data):
        pass


class InMemoryOnly(TinBoard):
    image = None

    def load_image(self):
        return self.image

    def store_image(self, data):
        self.image = data


class WritesOver(TinBoard):
    def store_image(self, data):
        self.path.write_bytes(data)


class WritesOverSlowly(TinBoard):
    def store_image(self, data):
        with self.path.open("wb") as file:
            for place in range(0, len(data), 256):
                file.write(data[place : place + 256])


class RemovesFirst(TinBoard):
    def store_image(self, data):
        new = self.path.with_suffix(".new")
        new.write_bytes(data)
        self.path.unlink(missing_ok=True)
        new.rename(self.path)


class TailStays(TinBoard):
    def store_image(self, data):
        old = self.load_image() or b""
        super().store_image(data + old[len(data) :])


class TakesSmallOnes(TinBoard):
    def store_image(self, data):
        if len(data) > 512:
            raise OSError("the EEPROM has 512 bytes")
        super().store_image(data)


class StoresText(TinBoard):
    def load_image(self):
        data = super().load_image()
        return bytearray(data) if data is not None else None


class NotesStates(TinBoard):
    def note(self, kind, at_ms, word, detail):
        {"state": 1, "frame": 2}[kind]


FRAME_ON_AIR_S = 0.06
BROKEN = [
    (NotWrapped, "wrap at 2^30"),
    (WrapsInTwelveDays, "on for some days"),
    (WrapsTooSoon, "neither sooner nor later"),
    (GoesBack, "went back"),
    (StandsStill, "stands still"),
    (FloatClock, "whole milliseconds"),
    (MicrosecondClock, "count milliseconds"),
    (NoClock, "override now_ms"),
    (NotDerived, "no method set_wheels"),
    (BadLevels, "levels is (0, 1000, 2000, 3000)"),
    (ShuffledLevels, "make_levels"),
    (BadNumber, "number is -1"),
    (BadRole, "is_leader is 'leader'"),
    (FramesStay, "same frames twice"),
    (FramesChecked, "odd parity"),
    (FramesAsText, "ints of 32 bits"),
    (NoFramesAtAll, "received_frames() gave None"),
    (DeafToMost, "gave none in all"),
    (LineAsText, "read_serial() gave ''"),
    (LineStays, "each byte is given once"),
    (LineWaits, "read_serial took 500 ms"),
    (WheelsOfThreeSpeeds, "set_wheels(0, 3) raised ValueError"),
    (WheelsByOne, "set_wheels(0, 0) raised TypeError"),
    (NoDarkness, "set_led(4) raised IndexError"),
    (SendsAndWaits, "send_frame took 60 ms"),
    (NeverSending, "right after send_frame"),
    (SendsForEver, "still True"),
    (SendsTooShort, "is on the air for"),
    (HearsItself, "can't hear while it sends"),
    (NoDistance, "obstacle_mm() gave None"),
    (FarInMetres, "obstacle_mm() gave 1.5"),
    (SaysWords, "heard_voice() gave 'stop'"),
    (SaysItAgain, "gave 1 twice"),
    (PersonByVolts, "sees_person() gave 1023"),
    (SensorUnplugged, "no PIR at pin 7"),
    (Forgets, "load_image() gave None"),
    (InMemoryOnly, "has lost the image"),
    (WritesOver, "a cut of power in store_image"),
    (WritesOverSlowly, "a cut of power in store_image"),
    (RemovesFirst, "a cut of power in store_image"),
    (TailStays, "load_image() gave"),
    (TakesSmallOnes, "the EEPROM has 512 bytes"),
    (StoresText, "bytearray"),
    (NotesStates, "raised KeyError"),
]
REAL_TIME = (WrapsInTwelveDays, WrapsTooSoon, MicrosecondClock)
