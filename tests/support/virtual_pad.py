"""A gamepad that SDL makes up, for tests: the code that reads it is the real one.

As a program, ``virtual_pad.py PORT ARGUMENT…``, it is the command line of a computer with such a gamepad, to which
happens what comes from that port of this computer: ``plug``, ``unplug``, ``push AXIS NUMBER``, ``hold BUTTON``.
"""

import ctypes
import os
import socket
import sys
import threading

from motorcade.drive.input.gamepad import load_sdl

# A pad that somebody has plugged into the computer of the tests is none of theirs.
_MAKER, _KIND = 0x1209, 0x0C0D
LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y, LEFT_TRIGGER, RIGHT_TRIGGER = range(6)
BUTTONS = 15
RIGHT_BUTTON, START = 1, 6
UP, DOWN = -32768, 32767


class VirtualPad:
    """``with VirtualPad(name) as pad: ...``: what a hand does to it, before and while it is plugged in."""

    def __init__(self, name: str = "Pad of the tests", is_gamepad: bool = True) -> None:
        os.environ["SDL_GAMECONTROLLER_IGNORE_DEVICES_EXCEPT"] = f"{_MAKER:#06x}/{_KIND:#06x}"
        self._sdl = load_sdl()
        self._name = name.encode()
        self._is_gamepad = is_gamepad
        self._stick = None
        self.number = -1

    def __enter__(self) -> "VirtualPad":
        assert self._sdl.SDL_InitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER) == 0
        return self

    def __exit__(self, *problem: object) -> None:
        self.unplug()
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER)

    def plug(self, *pushed: tuple[int, int]) -> None:
        """Plug it in, pushed already if the test says so."""
        sdl = self._sdl
        about = sdl.SDL_VirtualJoystickDesc()
        about.version, about.naxes, about.nbuttons = 1, 6, BUTTONS
        about.type = sdl.SDL_JOYSTICK_TYPE_GAMECONTROLLER if self._is_gamepad else sdl.SDL_JOYSTICK_TYPE_WHEEL
        about.vendor_id, about.product_id, about.name = _MAKER, _KIND, self._name
        # One look sees all of it.
        sdl.SDL_LockJoysticks()
        try:
            index = sdl.SDL_JoystickAttachVirtualEx(ctypes.byref(about))
            assert index >= 0, sdl.SDL_GetError()
            self._stick = sdl.SDL_JoystickOpen(index)
            self.number = sdl.SDL_JoystickInstanceID(self._stick)
            for axis, number in ((LEFT_TRIGGER, UP), (RIGHT_TRIGGER, UP), *pushed):
                self.push(axis, number)
        finally:
            sdl.SDL_UnlockJoysticks()

    def unplug(self) -> None:
        """Pull it out, if it is in."""
        if self._stick is None:
            return
        for index in range(self._sdl.SDL_NumJoysticks()):
            if self._sdl.SDL_JoystickGetDeviceInstanceID(index) == self.number:
                assert self._sdl.SDL_JoystickDetachVirtual(index) == 0
                break
        self._sdl.SDL_JoystickClose(self._stick)
        self._stick = None

    def push(self, axis: int, number: int) -> None:
        """Move an axis: -32768 is up, left, or a trigger at rest."""
        assert self._sdl.SDL_JoystickSetVirtualAxis(self._stick, axis, number) == 0

    def rest(self) -> None:
        """Let go."""
        for axis in range(6):
            self.push(axis, UP if axis in (LEFT_TRIGGER, RIGHT_TRIGGER) else 0)

    def hold(self, button: int, is_down: bool = True) -> None:
        """Hold a button, or let go of it."""
        assert self._sdl.SDL_JoystickSetVirtualButton(self._stick, button, is_down) == 0


def _obey(pad: VirtualPad, port: int) -> None:
    with socket.create_connection(("127.0.0.1", port)) as line:
        for order in line.makefile():
            act, *numbers = order.split()
            {"plug": pad.plug, "unplug": pad.unplug, "push": pad.push, "hold": pad.hold}[act](*map(int, numbers))


if __name__ == "__main__":
    from motorcade.cli import main

    with VirtualPad() as own_pad:
        threading.Thread(target=_obey, args=(own_pad, int(sys.argv.pop(1))), daemon=True).start()
        main()
