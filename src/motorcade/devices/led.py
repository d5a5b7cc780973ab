"""The LEDs: four lights, of which a word lights one (c4)."""

from motorcade.devices.declaration import (
    Between,
    Bits,
    Block,
    Column,
    Device,
    Input,
    Method,
    Option,
    Part,
    Role,
    StepKind,
    seconds,
)

# To send the colours of so many takes a slow chip half a millisecond.
MOST_PIXELS = 16


def _led(which: int) -> Role:
    return Role(f"led_{which}", True, f"LED {which}", needed=False, between=(Between("series", "330 Ω"),))


LED = Device(
    "led",
    bits=(
        Bits("led_which", 22, 21, "LED 0 to 3", "seed 000, c4"),
        Bits("led_duration", 20, 19, "level 0 (0 s: off) to 3 (longest)", "seed 000, c4"),
    ),
    group="led",
    hue=41,
    steps=(
        StepKind(
            "led",
            "Light one of the LEDs 0 to 3 for some seconds (c4).",
            Block("light", "M9 18h6M10 21h4M12 3a6 6 0 0 0-3.500 10.900V16h7v-2.100A6 6 0 0 0 12 3Z", in_start=True),
            inputs=(Input("which", "led_which", menu="light"), seconds("led_duration")),
        ),
    ),
    methods=(
        Method(
            "set_led",
            "Light LED 0 to 3 and no other; 4 for none.",
            (("which", 0, 4),),
            shown=Column("led", "uint8", "uint8", limits=(0, 4)),
        ),
    ),
    parts=(
        Part("leds", "GND", tuple([_led(which) for which in range(4)])),
        # All of them show the colour of the LED that is lit.
        Part(
            "pixels",
            "5 V, GND",
            (Role("signal", True, "DIN"),),
            options=(Option("count", 1, least=1, most=MOST_PIXELS),),
        ),
    ),
)
