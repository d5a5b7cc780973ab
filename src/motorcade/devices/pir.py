"""The PIR sensor: it detects people, for whom a word can make a car stand still (c7)."""

from motorcade.devices.declaration import Bits, Block, Device, Method, Part, Role, Sense, StepKind, Thing, seconds

PIR = Device(
    "pir",
    bits=(Bits("pir", 12, 12, "stands still while a person is sensed", "seed 000, c7"),),
    group="pir",
    hue=22,
    steps=(
        StepKind(
            "pir",
            "Stand still while a person is sensed (c7).",
            Block("sense", "M12 4a3 3 0 1 0 0 6 3 3 0 0 0 0-6ZM5.500 20a6.500 6.500 0 0 1 13 0"),
            inputs=(seconds(),),
            sets=(("pir", 1),),
            accompanies=True,
            minds="person",
        ),
    ),
    methods=(
        Method("sees_person", "Return whether the PIR sensor detects somebody.", returns="bool", missing="False"),
    ),
    senses=(Sense("person", "sees_person", "1 while a person is near, else 0"),),
    parts=(Part("pir", "5 V, GND", (Role("output", False, "OUT"),), read_by="sees_person"),),
    things=(Thing("person", "people", "walk", "the person"),),
)
