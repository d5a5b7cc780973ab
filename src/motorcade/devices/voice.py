"""The microphone: it hears 'stop' and 'go', which a word can make a car obey (c6)."""

from motorcade.devices.declaration import Bits, Block, Device, Method, Part, Role, StepKind, Thing, seconds

VOICE = Device(
    "voice",
    bits=(Bits("voice", 13, 13, "listens for 'stop' and 'go'", "seed 000, c6"),),
    group="voice",
    hue=263,
    steps=(
        StepKind(
            "voice",
            "Listen for 'stop' and 'go' (c6).",
            Block(
                "sense",
                "M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3ZM6 11a6 6 0 0 0 12 0M12 17v4M9 21h6",
            ),
            inputs=(seconds(),),
            sets=(("voice", 1),),
            accompanies=True,
            minds="voice",
        ),
    ),
    methods=(
        Method(
            "heard_voice",
            "Return the voice command since the last call: NO_VOICE, VOICE_STOP or VOICE_GO of `motorcade.car.brain`.",
            returns="int",
            missing="0",
        ),
    ),
    parts=(Part("voice", "3.3 V, GND", (Role("receive", False, "TX"),)),),
    things=(Thing("voice", "voices", "speech", "the word"),),
)
