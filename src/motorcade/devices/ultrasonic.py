"""The ultrasonic sensor: it measures the distance of obstacles, which a word can make a car avoid (c5)."""

from motorcade.devices.declaration import (
    Between,
    Bits,
    Block,
    Device,
    Input,
    Method,
    Part,
    Role,
    Sense,
    StepKind,
    Thing,
    seconds,
)

# Of the 5 V that the sensor gives.
_DIVIDER = (Between("ground", "2 kΩ", protects=True), Between("series", "1 kΩ", protects=True))

ULTRASONIC = Device(
    "ultrasonic",
    bits=(
        Bits("avoid_enable", 18, 18, "obstacles are avoided", "seed 000, c5"),
        Bits("avoid_radius", 17, 16, "level 0 (nearest) to 3", "seed 000, c5", "avoid_enable"),
        Bits("avoid_duration", 15, 14, "level 0 (0 s) to 3 (longest)", "seed 000, c5", "avoid_enable"),
    ),
    group="avoid",
    hue=166,
    steps=(
        StepKind(
            "avoid",
            "Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5).",
            Block("sense", "M12 3l8 3v6c0 5-4 8-8 9-4-1-8-4-8-9V6zM9 9l6 6M15 9l-6 6"),
            inputs=(Input("radius", "avoid_radius", menu="radius"), seconds("avoid_duration")),
            sets=(("avoid_enable", 1),),
            minds="obstacle",
        ),
    ),
    methods=(
        Method(
            "obstacle_mm",
            "Return the distance to the nearest obstacle ahead; NOTHING_IN_SIGHT_MM for none.",
            returns="int",
            missing="NOTHING_IN_SIGHT_MM",
        ),
    ),
    senses=(
        Sense("obstacle_mm", "obstacle_mm", "the distance of the nearest obstacle ahead in mm", 1 << 20, "looks_mm"),
    ),
    parts=(
        Part(
            "ultrasonic",
            "5 V, GND",
            (
                Role("trigger", True, "TRIG"),
                Role("echo", False, "ECHO", between=_DIVIDER),
                Role("signal", True, "SIG", between=_DIVIDER),
            ),
            forms=(("trigger", "echo"), ("signal",)),
        ),
    ),
    things=(
        Thing("wall", "walls", "ends", "the wall"),
        Thing("disc", "discs", "round", "a round obstacle"),
        Thing("polygon", "polygons", "corners", "a solid obstacle"),
    ),
)
