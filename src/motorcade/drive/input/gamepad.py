"""A gamepad, read by SDL, which knows each kind's buttons and axes by the same names."""

import ctypes
import warnings
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from motorcade.drive.input.deadman import CLEAR, STOP, Reading
from motorcade.drive.input.pad import PadNumbers, PadStick
from motorcade.drive.input.stick_failures import StickError
from motorcade.drive.safety.clock import monotonic_ms

_MOST_NAME = 40
_HINTS = {
    # There is no window that could have the focus, and no loop of messages.
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "SDL_JOYSTICK_THREAD": "1",
    "SDL_JOYSTICK_MFI": "0",
    # Ctrl-C is ours.
    "SDL_NO_SIGNAL_HANDLERS": "1",
    # A button is where it is, whatever is printed on it.
    "SDL_GAMECONTROLLER_USE_BUTTON_LABELS": "0",
}


def load_sdl() -> Any:
    """The module `sdl2`.

    Raises:
        ModuleNotFoundError: it isn't installed.
        StickError: ``no-sdl``, the library that it stands for isn't there.
    """
    with warnings.catch_warnings():
        # It warns of the library that it takes, each time.
        warnings.simplefilter("ignore")
        try:
            import sdl2
        except ModuleNotFoundError:
            raise
        except ImportError:
            raise StickError("no-sdl") from None
    return sdl2


class Gamepad:
    """The first gamepad that is there, which may come and go: ``with Gamepad() as pad: ...``, all in one thread.

    The right one of its four buttons is the emergency stop, Start lifts it.

    Args:
        clock: as of `motorcade.drive.safety.clock.monotonic_ms`.

    Raises:
        ModuleNotFoundError, StickError: as of `load_sdl`.
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
        """Begin. Raises StickError."""
        sdl = self._sdl
        for name, value in _HINTS.items():
            sdl.SDL_SetHint(name.encode(), value.encode())
        if sdl.SDL_InitSubSystem(sdl.SDL_INIT_GAMECONTROLLER):
            raise StickError("sdl-fails", reason=self._reason())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give it up."""
        self._close()
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER)

    def read(self) -> Reading:
        """What it says now; a look at which it has gone names no device, though there may be another."""
        orders, has_gone, notice = self._events()
        if has_gone:
            return Reading(None, notice=notice)
        if self._pad is None and self._may_be_there:
            self._may_be_there = False
            notice = self._open() or notice
        if self._pad is None:
            return Reading(None, notice=notice)
        return Reading(self._name, self._stick.axes(self._numbers(), self._clock()), orders, notice)

    def _events(self) -> tuple[tuple[str, ...], bool, StickError | None]:
        """The orders that were pressed, whether the pad has gone, and a notice."""
        # Of pads SDL tells what happens to the one that is open, of all devices when they come.
        sdl, event = self._sdl, self._sdl.SDL_Event()
        orders, has_gone = [], False
        notice: StickError | None = None
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
                notice = StickError("no-gamepad", name=_shown(sdl.SDL_JoystickNameForIndex(event.jdevice.which)))
        return tuple(orders), has_gone, notice

    def _open(self) -> StickError | None:
        """Take the first that can be had; why one can't."""
        sdl, notice = self._sdl, None
        for index in range(sdl.SDL_NumJoysticks()):
            if not sdl.SDL_IsGameController(index):
                continue
            name = _shown(sdl.SDL_GameControllerNameForIndex(index))
            self._pad = sdl.SDL_GameControllerOpen(index) or None
            if self._pad is not None:
                self._name, self._stick = name, PadStick()
                break
            notice = StickError("not-opened", name=name, reason=self._reason())
        return notice

    def _close(self) -> None:
        if self._pad is not None:
            self._sdl.SDL_GameControllerClose(self._pad)
        self._pad = None

    def _numbers(self) -> PadNumbers:
        sdl = self._sdl
        return PadNumbers(
            *(
                sdl.SDL_GameControllerGetAxis(self._pad, axis)
                for axis in (
                    sdl.SDL_CONTROLLER_AXIS_LEFTX,
                    sdl.SDL_CONTROLLER_AXIS_LEFTY,
                    sdl.SDL_CONTROLLER_AXIS_RIGHTX,
                    sdl.SDL_CONTROLLER_AXIS_RIGHTY,
                    sdl.SDL_CONTROLLER_AXIS_TRIGGERLEFT,
                    sdl.SDL_CONTROLLER_AXIS_TRIGGERRIGHT,
                )
            )
        )

    def _reason(self) -> str:
        return str(self._sdl.SDL_GetError().decode(errors="replace"))


def _shown(name: bytes | None) -> str:
    """What a device calls itself, fit for a terminal."""
    letters = (name or b"").decode(errors="replace")
    return "".join(each for each in letters if each.isprintable())[:_MOST_NAME] or "gamepad"
