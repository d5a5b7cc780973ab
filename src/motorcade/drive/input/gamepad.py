"""A gamepad, read by SDL, which gives buttons and axes the same names on every kind of gamepad.

The left stick drives, or the triggers do for speed, as on the car's page.
"""

import ctypes
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple, Self

from motorcade.drive.input.deadman import CLEAR, STOP, Axes, Reading
from motorcade.errors import MotorcadeError
from motorcade.timing import monotonic_ms
from motorcade.words.ticks import elapsed_ms

FULL = 32767
# A worn stick shows up to this share though nobody touches it. Larger than on a page, because this stick has priority.
DEAD_ZONE = 0.2
# A gamepad whose radio is out of reach shows its last numbers until its computer notices, which takes up to 20 s.
LONGEST_STILL_MS = 3000

_MOST_NAME = 40
# In the order of PadNumbers.
_AXES = ("LEFTX", "LEFTY", "RIGHTX", "RIGHTY", "TRIGGERLEFT", "TRIGGERRIGHT")
_HINTS = {
    # There is no window that has the focus, and no message loop.
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "SDL_JOYSTICK_THREAD": "1",
    "SDL_JOYSTICK_MFI": "0",
    # This program handles Ctrl-C.
    "SDL_NO_SIGNAL_HANDLERS": "1",
    # A button is named by its place, whatever is printed on it.
    "SDL_GAMECONTROLLER_USE_BUTTON_LABELS": "0",
}


class PadNumbers(NamedTuple):
    """What a gamepad shows, each -32768 to 32767, right and down positive; a trigger at rest is 0."""

    left_x: int
    left_y: int
    right_x: int
    right_y: int
    left_trigger: int
    right_trigger: int


class PadStick:
    """Make axes of a gamepad's numbers, while they show that somebody holds it. Pure, with time as an argument."""

    def __init__(self) -> None:
        self._last: PadNumbers | None = None
        self._changed_ms = 0

    def axes(self, numbers: PadNumbers, now_ms: int) -> Axes | None:
        """Throttle and steering, each -1 to 1; None where a push has not changed for LONGEST_STILL_MS."""
        if numbers != self._last:
            self._last, self._changed_ms = numbers, now_ms
        triggers = _beyond_dead_zone(numbers.right_trigger) - _beyond_dead_zone(numbers.left_trigger)
        stick = -_beyond_dead_zone(numbers.left_y)
        throttle = triggers if abs(triggers) > abs(stick) else stick
        steering = _beyond_dead_zone(numbers.left_x)
        if not (throttle or steering):
            # So that a stick that rests for days doesn't seem to have moved when the time wraps.
            self._changed_ms = now_ms
        return None if elapsed_ms(now_ms, self._changed_ms) > LONGEST_STILL_MS else (throttle, steering)


def load_sdl() -> Any:
    """The module `sdl2`.

    Raises:
        ModuleNotFoundError: it isn't installed.
        MotorcadeError: "no-sdl", the library SDL itself isn't installed.
    """
    with warnings.catch_warnings():
        # It warns each time of the library that it loads.
        warnings.simplefilter("ignore")
        try:
            import sdl2
        except ModuleNotFoundError:
            raise
        except ImportError:
            raise MotorcadeError("no-sdl") from None
    return sdl2


class Gamepad:
    """Read the first gamepad that is plugged in: ``with Gamepad() as pad: ...``, all in one thread.

    It may be unplugged and plugged in again. The right one of its four buttons is the emergency stop, Start lifts it.

    Args:
        clock: gives the time in ms that wraps.

    Raises:
        ModuleNotFoundError, MotorcadeError: see `load_sdl`.
    """

    def __init__(self, clock: Callable[[], int] = monotonic_ms) -> None:
        self._sdl = load_sdl()
        self._clock = clock
        self._orders = {self._sdl.SDL_CONTROLLER_BUTTON_B: STOP, self._sdl.SDL_CONTROLLER_BUTTON_START: CLEAR}
        self._stick = PadStick()
        self._pad: Any = None
        self._name = ""
        self._may_be_there = True

    def __enter__(self) -> Self:
        """Start SDL. Raises MotorcadeError."""
        sdl = self._sdl
        for name, value in _HINTS.items():
            sdl.SDL_SetHint(name.encode(), value.encode())
        if sdl.SDL_InitSubSystem(sdl.SDL_INIT_GAMECONTROLLER):
            raise MotorcadeError("sdl-fails", reason=self._reason())
        return self

    def __exit__(self, *_: object) -> None:
        """Close the gamepad and SDL."""
        self._close()
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER)

    def read(self) -> Reading:
        """What it shows now; the reading after it was unplugged has no device, even if another gamepad is there."""
        orders, has_gone, notice = self._events()
        if has_gone:
            return Reading(None, notice=notice)
        if self._pad is None and self._may_be_there:
            self._may_be_there = False
            notice = self._open() or notice
        if self._pad is None:
            return Reading(None, notice=notice)
        return Reading(self._name, self._stick.axes(self._numbers(), self._clock()), orders, notice)

    def _events(self) -> tuple[tuple[str, ...], bool, MotorcadeError | None]:
        """The orders that were pressed, whether the gamepad was unplugged, and a notice."""
        # SDL reports buttons of the open gamepad alone, and of every device that it is plugged in.
        sdl, event = self._sdl, self._sdl.SDL_Event()
        orders, has_gone = [], False
        notice: MotorcadeError | None = None
        while sdl.SDL_PollEvent(ctypes.byref(event)):
            if event.type == sdl.SDL_CONTROLLERBUTTONDOWN:
                if event.cbutton.button in self._orders:
                    orders.append(self._orders[event.cbutton.button])
            elif event.type == sdl.SDL_CONTROLLERDEVICEADDED:
                self._may_be_there = True
            elif event.type == sdl.SDL_CONTROLLERDEVICEREMOVED:
                self._close()
                has_gone = self._may_be_there = True
            elif event.type == sdl.SDL_JOYDEVICEADDED and not sdl.SDL_IsGameController(event.jdevice.which):
                notice = MotorcadeError("not-a-gamepad", name=_shown(sdl.SDL_JoystickNameForIndex(event.jdevice.which)))
        return tuple(orders), has_gone, notice

    def _open(self) -> MotorcadeError | None:
        """Open the first gamepad that can be opened. Returns why one can't."""
        sdl, notice = self._sdl, None
        for index in range(sdl.SDL_NumJoysticks()):
            if not sdl.SDL_IsGameController(index):
                continue
            name = _shown(sdl.SDL_GameControllerNameForIndex(index))
            self._pad = sdl.SDL_GameControllerOpen(index) or None
            if self._pad is not None:
                self._name, self._stick = name, PadStick()
                break
            notice = MotorcadeError("gamepad-not-opened", name=name, reason=self._reason())
        return notice

    def _close(self) -> None:
        if self._pad is not None:
            self._sdl.SDL_GameControllerClose(self._pad)
        self._pad = None

    def _numbers(self) -> PadNumbers:
        axes = (getattr(self._sdl, f"SDL_CONTROLLER_AXIS_{name}") for name in _AXES)
        return PadNumbers(*(self._sdl.SDL_GameControllerGetAxis(self._pad, axis) for axis in axes))

    def _reason(self) -> str:
        return str(self._sdl.SDL_GetError().decode(errors="replace"))


def _beyond_dead_zone(number: int) -> float:
    share = max(-1.0, min(number / FULL, 1.0))
    beyond = (abs(share) - DEAD_ZONE) / (1 - DEAD_ZONE)
    return 0.0 if beyond <= 0 else beyond if share > 0 else -beyond


def _shown(name: bytes | None) -> str:
    """A device's name, made safe for a terminal."""
    letters = (name or b"").decode(errors="replace")
    return "".join(each for each in letters if each.isprintable())[:_MOST_NAME] or "gamepad"
