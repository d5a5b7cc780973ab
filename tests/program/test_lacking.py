"""A program is warned about what its cars lack, before it is sent to any."""

from dataclasses import replace

from motorcade import Program, compile_program, forward, if_, led, obstacle, person, pir, repeat, together
from motorcade.config.profile import built_in_profile

CLASSROOM = built_in_profile("classroom")
PROGRAM = Program(
    [
        repeat(2, together(forward(1), pir())),
        forward(3, until=~obstacle(1)),
        if_(obstacle(2) | ~person(), [led(1, 1)]),
    ],
    [pir(1)],
)


def warned(*lacks):
    found = compile_program(PROGRAM, replace(CLASSROOM, lacks=lacks))
    assert found.words
    return [(problem.path, problem.sentence()) for problem in found.diagnostics if problem.code == "car-lacks"]


def test_each_step_that_needs_what_the_car_lacks_is_named_with_what_that_means():
    assert warned() == []
    waits = "This car has no person sensor: the word waits for nobody"
    paths = ["leader[0].repeat.steps[0].together[1]", "leader[2]", "followers.steps[0]"]
    assert warned("pir") == [(path, waits) for path in paths]
    assert [path for path, _ in warned("ultrasonic")] == ["leader[1]", "leader[2]"]
    assert [path for path, _ in warned("led")] == ["leader[2].if.then[0]"]
    assert len(warned("pir", "ultrasonic")) == 5
