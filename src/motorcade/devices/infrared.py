"""Infrared: a leader sends words, and followers receive them and pass them on (c1, c2)."""

from motorcade.devices.declaration import Between, Bits, Column, Device, Method, Part, Role

INFRARED = Device(
    "infrared",
    bits=(
        Bits("accept_ir", 31, 31, "a follower listens to infrared", "seed 000, c1"),
        Bits("forward", 30, 30, "passes words on by infrared", "seed 000, c2"),
    ),
    group="infrared",
    hue=0,
    methods=(
        Method(
            "received_frames",
            "Return the 32-bit infrared frames that ended since the last call, in order.\n\n"
            "The board doesn't check their parity.",
            returns="list[int] | tuple[int, ...]",
            missing="()",
        ),
        Method("senses_carrier", "Return whether other cars send infrared here now.", returns="bool", missing="False"),
        Method(
            "is_sending",
            "Return whether this car sends a frame now.",
            returns="bool",
            missing="False",
            shown=Column("sends", "uint8", "bool", is_pictured=False),
        ),
        Method(
            "send_frame",
            "Begin to send 32 bits by infrared; called only while nothing is being sent.",
            (("frame", 0, 0xFFFFFFFF),),
        ),
    ),
    parts=(
        Part(
            "infrared",
            "",
            (
                # At 5 V its output could damage a pin that takes 3.3 V.
                Role("receiver", False, "OUT, VS1838B", needed=False, supply="{chip}, GND"),
                Role(
                    "sender",
                    True,
                    "LED 940 nm, 33 Ω",
                    needed=False,
                    supply="5 V",
                    between=(Between("series", "1 kΩ"), Between("transistor", "NPN")),
                ),
            ),
        ),
    ),
)
