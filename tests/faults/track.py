"""Driving in a quiet simulated room: one act follows another, and all that a car does is compared with docs/drive.md.

Each answer, each movement and each count is known beforehand. `tests.faults.driving` has networks, hardware and
programs that fail.
"""

from types import SimpleNamespace

from tests.faults import track_clients, track_drivers, track_limits, track_log, track_places
from tests.faults.loop import SimulatedLoop
from tests.faults.system import THREADS, replaced
from tests.faults.track_car import Track
from tests.faults.world import World

from motorcade.drive import client as drive_client
from motorcade.drive import server as drive_server
from motorcade.drive import session as drive_session

_MOST_ACTS = 5
ACTS = (*track_drivers.ACTS, *track_places.ACTS, *track_limits.ACTS, *track_clients.ACTS, *track_log.ACTS)


def run_track(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run = Track(room)

    async def live() -> None:
        for act in run.random.sample(ACTS, _MOST_ACTS):
            room.note("act", act.__name__)
            await act(run)
        room.is_over = True

    names = {
        (drive_session, "threading"): THREADS,
        (drive_server, "threading"): THREADS,
        (drive_client, "random"): SimpleNamespace(uniform=run.random.uniform),
    }
    with replaced(names):
        SimulatedLoop(run.people, run.network).run(live)
        room.run(600.0)
        room.keep("goes-on", room.is_over, "the last act never ended")
