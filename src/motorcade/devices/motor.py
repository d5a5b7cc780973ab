"""The motor: two wheels that drive forward or turn on the spot (c3); and the chassis of a car that somebody drives."""

from motorcade.devices.declaration import (
    LEVELS,
    Between,
    Bits,
    Block,
    Call,
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

DIRECTIONS = ("forward", "left", "right", "random")
SPEED = Input("speed", "motor_speed", menu="speed", first=2)
SECONDS = seconds("motor_duration")


def wheel_motor(key: str, terminals: "tuple[str, str, str]") -> Part:
    """Return a motor behind a driver.

    An L298's ``terminals`` are forward, backward and enable; other drivers have one for the direction, and enable.
    """
    forward, backward, enable = terminals
    roles = (
        Role("forward", True, forward),
        Role("backward", True, backward),
        # The motors stand still while no program drives the pin.
        Role("enable", True, enable, between=(Between("ground", "10 kΩ"),)),
        Role("direction", True, "DIR"),
    )
    forms = (("forward", "backward"), ("forward", "backward", "enable"), ("direction", "enable"))
    # The level of the pin for the direction while the motor turns forward.
    options = (Option("forward_is", "high", LEVELS),)
    return Part(key, "6–12 V, GND", roles, forms=forms, options=options)


MOTOR = Device(
    "motor",
    bits=(
        Bits("motor_enable", 29, 29, "the wheels are driven", "seed 000, c3"),
        Bits("motor_direction", 28, 27, "0 forward, 1 left, 2 right, 3 random", "seed 000, c3", "motor_enable"),
        Bits("motor_speed", 26, 25, "0 standing still to 3 fastest", "seed 000, c3", "motor_enable"),
        Bits("motor_duration", 24, 23, "level 0 (0 s) to 3 (longest)", "seed 000, c3", "motor_enable"),
    ),
    group="motor",
    hue=219,
    steps=(
        StepKind(
            "drive",
            "Drive or turn for some seconds; speed level 0 stands still, 3 is fastest (c3).",
            Block(
                "drive",
                "M4 15v-3l3-5h8l4 5h1v3zM7 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4ZM17 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z",
                in_start=True,
            ),
            inputs=(Input("direction", "motor_direction", options=DIRECTIONS), SPEED, SECONDS),
            sets=(("motor_enable", 1),),
            calls=(
                Call("forward", "Drive straight on.", (("direction", "forward"),), ("seconds", "speed")),
                Call("left", "Turn left on the spot.", (("direction", "left"),), ("seconds", "speed")),
                Call("right", "Turn right on the spot.", (("direction", "right"),), ("seconds", "speed")),
                Call("wander", "Drive on with random turns.", (("direction", "random"),), ("seconds", "speed")),
            ),
        ),
        StepKind(
            "wait",
            "Stand still for some seconds (c3 at speed 0).",
            Block("drive", "M7 3h10M7 21h10M8 3c0 5 8 5 8 9s-8 4-8 9M16 3c0 5-8 5-8 9s8 4 8 9", in_start=True),
            inputs=(SECONDS,),
            sets=(("motor_enable", 1), ("motor_direction", 0), ("motor_speed", 0)),
        ),
    ),
    methods=(
        Method(
            "set_wheels",
            "Drive forward (0) or turn on the spot, left (1) or right (2), at level 0 (stop) to 3.",
            (("direction", 0, 2), ("speed_level", 0, 3)),
            # direction * 4 + speed level; direction 3 where somebody drives the car.
            shown=Column("wheels", "uint8", "uint8", limits=(0, 15)),
        ),
    ),
    parts=(
        wheel_motor("left_motor", ("IN1", "IN2", "ENA")),
        wheel_motor("right_motor", ("IN3", "IN4", "ENB")),
        wheel_motor("left_rear_motor", ("IN1", "IN2", "ENA")),
        wheel_motor("right_rear_motor", ("IN3", "IN4", "ENB")),
        Part("motor_driver", "GND", (Role("standby", True, "STBY"),)),
    ),
)

# A steering servo and a drive motor.
CHASSIS = Device(
    "chassis",
    parts=(
        Part("servo", "5 V, GND", (Role("signal", True, "SIG"),)),
        wheel_motor("drive_motor", ("IN1", "IN2", "ENA")),
    ),
)
