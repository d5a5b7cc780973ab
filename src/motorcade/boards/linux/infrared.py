"""Send infrared frames on Linux. `motorcade.boards.on_chip.infrared` receives them.

A LIRC device (``/dev/lirc0``) takes a frame's marks and spaces in µs and modulates them with a 38 kHz carrier, which a
Python program couldn't time; `pwm-ir-tx` makes the carrier by the hardware's PWM. Source: the kernel's documentation,
userspace-api/media/rc/lirc-write.
"""

import os
import struct
import sys
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from queue import SimpleQueue

from motorcade.boards.on_chip.infrared import CARRIER_HZ
from motorcade.errors import MotorcadeError
from motorcade.words.infrared import frame_durations_us

# linux/lirc.h
_GET_FEATURES = 0x80046900
_SET_SEND_CARRIER = 0x40046913
_CAN_SEND_PULSE = 0x00000002
_CAN_SET_SEND_CARRIER = 0x00000100

Ioctl = Callable[[int, int, bytes], bytes]


def open_sender(folder: Path = Path("/dev"), ioctl: Ioctl | None = None) -> int:
    """Open the first LIRC device in ``folder`` that can send, set it to 38 kHz and return its file descriptor.

    Raises:
        MotorcadeError: there is none, or this user may not use it.
    """
    # A car opens its pins before this, and Windows has none.
    import fcntl

    control: Ioctl = ioctl or fcntl.ioctl
    forbidden = None
    for path in sorted(folder.glob("lirc*")):
        try:
            device = os.open(path, os.O_RDWR)
        except PermissionError:
            forbidden = path
            continue
        features = int.from_bytes(control(device, _GET_FEATURES, bytes(4)), sys.byteorder)
        if features & _CAN_SEND_PULSE:
            if features & _CAN_SET_SEND_CARRIER:
                control(device, _SET_SEND_CARRIER, struct.pack("=I", CARRIER_HZ))
            return device
        os.close(device)
    if forbidden:
        raise MotorcadeError("infrared-forbidden", path=forbidden)
    raise MotorcadeError("no-infrared-sender")


class LircSender:
    """Send frames one at a time, in a thread of its own, since a write returns only when the frame has been sent.

    Args:
        device: a file descriptor; each frame is one write of native 32-bit durations. Closed by ``close``.
        unit_us: the unit of a frame.
        clock_s: a clock in seconds, the same as that of the receiver's edges.

    Attributes:
        ended_s: when the last frame ended.
    """

    def __init__(self, device: int, unit_us: int, clock_s: Callable[[], float]) -> None:
        self._device = device
        self._unit_us = unit_us
        self._clock_s = clock_s
        self._frames: SimpleQueue[int | None] = SimpleQueue()
        self._is_sending = False
        self._problem: OSError | None = None
        self.ended_s = clock_s()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def send(self, frame: int) -> None:
        """Begin to send 32 bits. Raises MotorcadeError where an earlier frame could not be sent."""
        if self._problem is not None:
            raise MotorcadeError("infrared-sender-fails", reason=self._problem)
        self._is_sending = True
        self._frames.put(frame)

    def is_sending(self) -> bool:
        """Return whether a frame is on the air."""
        return self._is_sending

    def close(self) -> None:
        """Finish the frame that has begun and close the device."""
        self._frames.put(None)
        self._thread.join()
        os.close(self._device)

    def _work(self) -> None:
        while (frame := self._frames.get()) is not None:
            durations_us: Iterable[int] = frame_durations_us(frame, self._unit_us)
            try:
                os.write(self._device, struct.pack("=67I", *durations_us))
            except OSError as problem:
                self._problem = problem
            self.ended_s = self._clock_s()
            self._is_sending = False
