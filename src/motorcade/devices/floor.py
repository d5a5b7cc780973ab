"""The floor sensors: two under the front of the car, which a word can make the motor obey (first bit of c8)."""

from motorcade.devices.declaration import (
    LEVELS,
    THRESHOLD,
    Bits,
    Block,
    Call,
    Device,
    Input,
    Method,
    Option,
    Part,
    Role,
    Sense,
    StepKind,
    Thing,
    seconds,
)
from motorcade.devices.motor import SECONDS

# Standing still needs no sense of the floor.
_SPEED = Input("speed", "motor_speed", menu="speed", first=2, least=1)

FLOOR = Device(
    "floor",
    bits=(Bits("floor", 11, 11, "the motor obeys dark and light floor", "protocol, section 11"),),
    group="floor",
    hue=95,
    steps=(
        StepKind(
            "follow_line",
            "Drive along a dark line for some seconds (c3 forward with the bit floor).",
            Block("sense", "M5 21c0-7 14-7 14-13V3M9 3h10M9 21H1"),
            inputs=(_SPEED, SECONDS),
            sets=(("motor_enable", 1), ("motor_direction", 0), ("floor", 1)),
            calls=(Call("follow_line", "Drive along a dark line.", order=("seconds", "speed")),),
            group="motor",
        ),
        StepKind(
            "turn_to_line",
            "Turn until a line is under the car, then stand (c3 left or right with the bit floor).",
            Block("sense", "M6 21V9a5 5 0 0 1 10 0v2M12 8l4 4 4-4M3 21h18"),
            inputs=(Input("direction", "motor_direction", options=("left", "right"), least=1), _SPEED, SECONDS),
            sets=(("motor_enable", 1), ("floor", 1)),
            calls=(
                Call("turn_left_to_line", "Turn left to a line.", (("direction", "left"),), ("seconds", "speed")),
                Call("turn_right_to_line", "Turn right to a line.", (("direction", "right"),), ("seconds", "speed")),
            ),
            group="motor",
        ),
        StepKind(
            "floor",
            "Mind the floor: what the motor does beside it obeys dark and light (the bit floor).",
            Block("sense", "M4 20h16M8 4v9M16 4v9M6 13h4M14 13h4"),
            inputs=(seconds(),),
            sets=(("floor", 1),),
            accompanies=True,
            minds="floor",
        ),
    ),
    methods=(
        Method(
            "dark_floor",
            "Return which floor sensors are over dark floor: 1 for the left one plus 2 for the right one.",
            returns="bits",
            missing="0",
        ),
    ),
    senses=(Sense("dark_floor", "dark_floor", "the floor sensors over dark floor, 1 the left plus 2 the right one"),),
    # A TCRT5000 module's output is high where no light comes back from the floor.
    parts=(
        Part(
            "floor",
            "{chip}, GND",
            (Role("left", False, "DO, TCRT5000 left"), Role("right", False, "DO, TCRT5000 right")),
            read_by="dark_floor",
            options=(Option("dark", "high", LEVELS), THRESHOLD),
            active="dark",
        ),
    ),
    things=(
        Thing("line", "lines", "line", "a dark line on the floor", is_flat=True),
        Thing("patch", "patches", "corners", "a dark patch", is_flat=True),
        Thing("spot", "spots", "round", "a round dark spot", is_flat=True),
    ),
)
