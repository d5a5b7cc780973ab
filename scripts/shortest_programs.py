"""Search for the shortest program of each mission that comes with Motorcade: src/motorcade/missions/shortest.json.

    python -m scripts.shortest_programs [MISSION …]

The search begins with the mission's own solution, and has RUNS runs; where the archive keeps no program that the check
gives all stars, it is the solution. It takes about a minute of one core for a mission,
so `make generate` doesn't do it.
"""

import json
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from motorcade.lab.run import Results, Tasks
from motorcade.lab.search import Search, do_task, opened_archive
from motorcade.missions.document import built_in_mission, missions
from motorcade.program.model import count_blocks

RUNS = 900
FILE = Path(__file__).resolve().parent.parent / "src" / "motorcade" / "missions" / "shortest.json"


def here(search: Tasks, numbers: Iterable[int | None]) -> Results:
    """Workers that are this process."""
    for number in numbers:
        assert number is not None
        yield number, do_task(search.task(number))


def shortest(name: str) -> dict[str, object]:
    """The entry of a mission."""
    mission = built_in_mission(name)
    assert mission.solution is not None
    search = Search(mission, "map-elites", RUNS, start=[mission.solution])
    with tempfile.TemporaryDirectory() as folder, opened_archive(Path(folder), search.contents) as archive:
        search.run(archive, here)
    best = search.shortest()
    program = best.program if best else mission.solution
    return {"blocks": count_blocks(program), "runs": search.done, "program": program.as_dict()}


def main() -> None:
    """Search for the missions that are named, or for all."""
    for name in sys.argv[1:] or [each.id for each in missions()]:
        found = shortest(name)
        known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        lines = (f"{json.dumps(key)}: {json.dumps(each)}" for key, each in sorted({**known, name: found}.items()))
        FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
        print(name, found["blocks"], "blocks", flush=True)


if __name__ == "__main__":
    main()
