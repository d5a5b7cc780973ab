"""The cars of a room on pages: found, ticked, loaded and stopped by a teacher."""

from playwright.sync_api import expect

from motorcade import Program, compile_program, forward, led
from motorcade.fleet.places import list_text
from motorcade.program.blocks import blocks_of
from support.class_visits import class_room
from support.rooms import FIRST, simulated_cars
from support.waiting import wait_until

PROGRAM = Program([forward(2), led(1, 1)])


def test_a_teacher_loads_ticked_cars_with_an_own_project_and_stops_all(browser, page_built, tmp_path) -> None:
    listed = tmp_path / "room.toml"
    with simulated_cars(2) as cars:
        listed.write_text(list_text([("ada", cars[0].address), ("bo", cars[1].address)]), encoding="utf-8")
        with class_room(browser, tmp_path / "class", "--list", str(listed)) as room:
            teacher = room.teacher
            leader, followers = blocks_of(PROGRAM)
            project = {"leader": leader, "followers": followers, "profile": "classroom"}
            message = {"name": "Parade", "project": project}
            write = "message => fetch('/api/projects/write', {method: 'POST', body: JSON.stringify(message)})"
            teacher.page.evaluate(write, message)
            part = teacher.part("cars")
            tick = part.get_by_label(teacher.say("cars.tick", name="car-1"), exact=True)
            tick.check()
            load = part.get_by_role("button", name=teacher.say("cars.load", count=1))
            expect(load).to_be_disabled()
            part.get_by_label(teacher.say("class.carProject")).select_option("Parade")
            load.click()
            row = part.get_by_role("listitem").filter(has_text="car-1")
            expect(row).to_contain_text(teacher.say("cars.new"))
            expect(row).to_contain_text("Parade")
            # One button stops all cars, those that are driven, too.
            expect(teacher.button("cars.stopAll")).to_have_count(0)
            teacher.button("class.stopAll").click()
            stopped = part.get_by_role("listitem").filter(has_text=teacher.say("cars.stopped"))
            expect(stopped).to_have_count(2)
            teacher.button("class.releaseAll").click()
            expect(stopped).to_have_count(0)
            teacher.button("class.stopAll").click()
            expect(stopped).to_have_count(2)
        wait_until(lambda: [car.wheels for car in cars] == [(0, 0)] * 2)
        assert [car.image for car in cars] == [FIRST, compile_program(PROGRAM).image]
