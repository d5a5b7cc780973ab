"""Why a stick can't be read: stable codes, and their sentences in English and Chinese."""

from motorcade.errors import Sentences, ToldError

MESSAGES: Sentences = {
    "no-sdl": {
        "en": "The library SDL 2 isn't there, which reads gamepads: sudo apt install libsdl2-2.0-0",
        "zh": "缺少读取手柄所需的 SDL 2 库：sudo apt install libsdl2-2.0-0",
    },
    "sdl-fails": {
        "en": "SDL can't read gamepads here ({reason}).",
        "zh": "SDL 无法在此读取手柄（{reason}）。",
    },
    "no-gamepad": {
        "en": "{name} is no gamepad that SDL knows. SDL_GAMECONTROLLERCONFIG can describe it.",
        "zh": "SDL 不认识手柄 {name}。可用 SDL_GAMECONTROLLERCONFIG 描述它。",
    },
    "not-opened": {
        "en": "{name} can't be used ({reason}).",
        "zh": "{name} 无法使用（{reason}）。",
    },
}


class StickError(ToldError, OSError):
    """A stick can't be read."""

    SENTENCES = MESSAGES
