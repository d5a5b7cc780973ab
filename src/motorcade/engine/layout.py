"""Turn a mat and a profile into the arrays of the engine: metres and degrees become µm and binary angles.

This module needs no NumPy, which a browser doesn't have: arrays are buffers until a backend allocates them.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate, chain
from typing import TYPE_CHECKING, Any, NamedTuple

from motorcade.car.brain import AVOID_RADII_MM, FORWARD, LEFT, RIGHT, SIZE, VOICE_GO, VOICE_STOP
from motorcade.car.decisions import SIZE as DECISIONS
from motorcade.config.profile import Profile, levels_of
from motorcade.engine.backend import Backend, allocate_all
from motorcade.engine.bodies import LOOK_BEYOND_UM, person_at
from motorcade.engine.cells import GROUP
from motorcade.engine.geometry import COSINES, FAR_UM, FULL_TURN, MOST_NORMAL, NORMALS, to_heading
from motorcade.engine.state import (
    MOST_PARTS,
    NOBODY,
    SPARE,
    Around,
    Buffer,
    CarArrays,
    Cells,
    Obstacles,
    People,
    Rules,
    Voices,
)
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat
from motorcade.words.infrared import air_us
from motorcade.words.packing import bytes_to_words

if TYPE_CHECKING:
    from motorcade.engine.backend import Backend

_Wall = tuple[float, float, float, float]
_Disc = tuple[float, float, float]

VOICES = {"stop": VOICE_STOP, "go": VOICE_GO}
_FIELDS = CarArrays._fields[2:-4]
_SIGNED = ("x", "y", "displacement_x", "displacement_y")
# Bytes of a car, with events and room for cells; without events it is about half.
BYTES_A_CAR = 256
# Cars are sorted by cells again before any of them can have gone farther.
_DRIFT_UM = 100_000
_LINE = 16  # cars in a cache line
# So many bytes are two cache lines, which processors fetch together.
_APART = 128
CELL_UM = 450_000.0
# With so few cars, checking all of them is faster than cells.
_FEW_CARS = 32
# With more cars around a sender, each line of sight looks for those near it.
_MOST_AROUND = 1 << 8
_NEVER = 1 << 40
_OBSTACLE_CELL_UM = 250_000.0
# A displacement is 32 bits of 2^-12 µm.
_LONGEST_WAY_UM = 480_000
_FEW_OBSTACLE_CELLS = 1 << 14
# Wheel noise that moves no car by a part of a µm, yet lets the kernels compute each tick's way anew.
_LITTLE_NOISE = 1e-12


class Standing(NamedTuple):
    """Where the cars of one world stand before its first tick, and who leads: fields of `CarArrays`, as buffers."""

    x: Any
    y: Any
    heading: Any
    number: Any
    program: Any


def rules_of(mat: Mat, profile: Profile, images: Sequence[bytes]) -> Rules:
    """Return the figures of a world in the engine's units. Raises MotorcadeError: the profile can't be simulated."""
    body = profile.body
    physics = mat.physics
    tick_ms = mat.tick_ms
    radius = body.diameter_mm * 500.0
    # mm/s times ms is µm.
    speeds = [float(speed) * tick_ms for speed in profile.speeds_mm_s]
    turns = [0] * 16
    for level, rate in enumerate(profile.turn_rates_deg_s):
        turns[LEFT * 4 + level] = round(rate * tick_ms / 360_000 * FULL_TURN)
        turns[RIGHT * 4 + level] = -turns[LEFT * 4 + level]
    for level, speed in enumerate(speeds):
        # mrad/m times µm is 1e-9 rad.
        turns[FORWARD * 4 + level] = round(profile.wheels.drift_mrad_per_m * speed * 1e-9 / math.tau * FULL_TURN)
    wheel_turn = FULL_TURN / math.tau / (body.wheel_base_mm * 1000)
    of_wheels = max(max(speeds), max(turns) / wheel_turn / 2 if physics.wheel_noise else 0.0)
    fastest = math.ceil(of_wheels * (1 + MOST_NORMAL * physics.wheel_noise))
    _check(profile, tick_ms, fastest, radius)
    few = len(mat.starts) <= _FEW_CARS
    sort_every = _NEVER if few else max(_DRIFT_UM // fastest, 1)
    # Duties are no reason: the speeds are of a car that drives with them.
    is_bent = profile.wheels.drift_mrad_per_m != 0 or profile.wheels.stopping_ms > 0
    return Rules(
        levels=Buffer.of("int64", levels_of(profile)),
        images=_images(images),
        cosines=Buffer.of("float64", COSINES),
        normals=Buffer.of("float64", NORMALS),
        flips=Buffer.of("float64", _flips(physics.bit_error_rate)),
        speeds=Buffer.of("float64", speeds),
        turns=Buffer.of("int64", turns),
        wheel_turn=wheel_turn,
        tick_ms=tick_ms,
        fastest=float(fastest),
        collisions=int(physics.collisions),
        line_of_sight=int(physics.line_of_sight),
        radius=radius,
        contact=2 * radius,
        beyond=FAR_UM if few else LOOK_BEYOND_UM,
        ultrasonic_range_mm=body.ultrasonic_range_mm,
        cone_cos=_cosine(body.ultrasonic_cone_deg),
        cone_sin=_cosine(90 - body.ultrasonic_cone_deg),
        pir_range=body.pir_range_mm * 1000.0,
        pir_cos=_cosine(min(body.pir_half_angle_deg, 180)),
        person_step=_person_step(mat),
        range=profile.infrared.range_mm * 1000.0,
        beam_cos=_cosine(physics.beam_half_angle_deg) if physics.beam_half_angle_deg < 180 else -2.0,
        capture=float(physics.capture_ratio or 0.0),
        wheel_noise=float(physics.wheel_noise) or _LITTLE_NOISE * is_bent,
        coast=profile.wheels.stopping_ms / (profile.wheels.stopping_ms + tick_ms),
        floor_ahead=profile.floor.ahead_mm * 1000.0,
        floor_aside=profile.floor.apart_mm * 500.0,
        floor_step=_floor_step(profile, float(fastest), max(turns)),
        floor_turn=_floor_reach(profile) * math.tau / FULL_TURN,
        drift=float(sort_every * fastest),
        sort_every=int(sort_every),
        cell=FAR_UM if few else CELL_UM,
        strip=_strip_um(profile, 2 * radius, sort_every * fastest),
    )


def _strip_um(profile: Profile, contact: float, drift: float) -> float:
    """From how far another car can matter to a car until the next sort, by its body, its sensors or its infrared."""
    look = contact + max(levels_of(profile)[AVOID_RADII_MM : AVOID_RADII_MM + 4]) * 1000.0 + LOOK_BEYOND_UM
    # Bodies around a sender shade others, and both cars may have gone some way since the last sort.
    return float(max(profile.infrared.range_mm * 1000.0, look) + contact + 4 * drift)


def cars_of(worlds: int, per_world: int, memory: "Backend") -> CarArrays:
    """Allocate the arrays of all cars, filled with zeros."""
    count = worlds * per_world
    # Fields are an odd number of cache lines apart. Otherwise all fields of a car would be in a few sets of the cache.
    # One column is never used, so that rows are never contiguous: Numba would compile the kernels for both layouts.
    lines = -(-(count + 1) // _LINE) | 1
    rows = memory.zeros("rows", (SIZE + len(_FIELDS), lines * _LINE), "uint32")[:, :count]
    fields = {
        name: rows[SIZE + k].view("int32") if name in _SIGNED else rows[SIZE + k] for k, name in enumerate(_FIELDS)
    }
    push, order = (memory.zeros(name, (count,), "uint32") for name in ("push", "order"))
    wheels, program = (memory.zeros(name, (count,), "uint8") for name in ("wheels", "program"))
    return CarArrays(rows=rows, memory=rows[:SIZE], **fields, push=push, order=order, wheels=wheels, program=program)


def standing_of(mat: Mat, images: int) -> Standing:
    """Where the mat's cars stand; its k-th leader runs image k, modulo their number."""
    starts = mat.starts
    ranks = accumulate(starts.leads)
    return Standing(
        x=Buffer.of("int32", [round(x_m * 1e6) for x_m in starts.x_m]),
        y=Buffer.of("int32", [round(y_m * 1e6) for y_m in starts.y_m]),
        heading=Buffer.of("uint32", [to_heading(radians) for radians in starts.heading]),
        number=Buffer.of("uint32", range(len(starts))),
        program=Buffer.of(
            "uint8",
            [(rank - 1) % max(images, 1) + 1 if leads else 0 for leads, rank in zip(starts.leads, ranks, strict=True)],
        ),
    )


def farthest_um(x_um: Sequence[int], y_um: Sequence[int]) -> int:
    """The largest coordinate of all cars, without its sign."""
    return max(max(x_um), -min(x_um), max(y_um), -min(y_um))


def put_in_place(cars: CarArrays, standing: Standing, worlds: int, memory: "Backend") -> None:
    """Reset the cars to their state before the first tick."""
    for array_of_cars in (cars.rows, cars.push, cars.wheels):
        memory.clear(array_of_cars)
    nobody = NOBODY.to_bytes(4, "little")
    memory.write(cars.heard_from, nobody * int(cars.heard_from.shape[0]))
    for name, buffer in standing._asdict().items():
        memory.write(getattr(cars, name), buffer.items.tobytes() * worlds)


def decisions_of(worlds: int, standing: Standing, memory: "Backend") -> Any:
    """Allocate what the leaders of the worlds remember of their decisions, and a row that nobody uses."""
    leaders = sum(program > 0 for program in standing.program.items)
    return memory.zeros("decisions", (max(worlds * leaders, 1), DECISIONS), "uint8")


def cells_of(worlds: int, per_world: int, memory: "Backend") -> Cells:
    """Allocate the cells of the worlds: at most five cells for eight cars, and a few more."""
    return Cells(
        first=memory.zeros("first", (worlds, per_world * 5 // 8 + 17), "int32"),
        frame=memory.zeros("frame", (worlds, 5), "float64"),
        strips=memory.zeros("strips", (2, MOST_PARTS + 1), "int64"),
    )


def around_of(shares: int, per_world: int, memory: "Backend") -> Around:
    """Allocate scratch memory for lists of cars and for groups that rest, for each share."""
    shape = shares, _far_apart(min(per_world, _MOST_AROUND) + SPARE)
    groups = shares, _far_apart(-(-per_world // GROUP))
    return Around(
        x=memory.zeros("Around.x", shape, "float64"),
        y=memory.zeros("Around.y", shape, "float64"),
        car=memory.zeros("Around.car", shape, "int32"),
        looks=memory.zeros("Around.looks", shape, "int32"),
        wakes=memory.zeros("Around.wakes", groups, "int64"),
        moves=memory.zeros("Around.moves", groups, "uint8"),
    )


def _far_apart(items: int) -> int:
    """How many items a row has so that no two threads write to one cache line."""
    return -(-items // _APART) * _APART


def people_of(mat: Mat, parts: int) -> People:
    """The paths of the mat's people."""
    points = [point for person in mat.people for point in person.path]
    nowhere = [0.0] * (parts * len(mat.people))
    return People(
        first=Buffer.of("int64", accumulate((len(person.path) for person in mat.people), initial=0)),
        at_ms=Buffer.of("int64", [round(t_s * 1000) for t_s, _, _ in points]),
        x=Buffer.of("float64", [x * 1e6 for _, x, _ in points]),
        y=Buffer.of("float64", [y * 1e6 for _, _, y in points]),
        repeats=Buffer.of("int64", [person.repeats for person in mat.people]),
        now_x=Buffer.of("float64", nowhere, len(mat.people), parts),
        now_y=Buffer.of("float64", nowhere, len(mat.people), parts),
        walked_ms=Buffer.of("int64", [-1] * parts),
    )


def people_at(mat: Mat, t_ms: int, backend: Backend) -> list[tuple[float, float]]:
    """Return the position of each person of the mat at a moment, (x, y) in metres; ``backend`` keeps their paths."""
    paths = allocate_all(backend, people_of(mat, 1))
    places = (person_at(number, t_ms, paths) for number in range(len(mat.people)))
    return [(x / 1e6, y / 1e6) for x, y in places]


def voices_of(mat: Mat) -> Voices:
    """Return the voices of the mat, in the order of time."""
    voices = sorted(mat.voices, key=lambda voice: voice.at_s)
    return Voices(
        at_ms=Buffer.of("int64", [round(voice.at_s * 1000) for voice in voices]),
        word=Buffer.of("int64", [VOICES[voice.word] for voice in voices]),
        x=Buffer.of("float64", [voice.x_m * 1e6 for voice in voices]),
        y=Buffer.of("float64", [voice.y_m * 1e6 for voice in voices]),
        radius=Buffer.of("float64", [FAR_UM if voice.radius_m is None else voice.radius_m * 1e6 for voice in voices]),
    )


def obstacles_of(mat: Mat, rules: Rules, backend: "Backend", look_mm: int = 0) -> Obstacles:
    """Walls and obstacles, and for each cell of the mat a list of those that can matter to a car in it.

    ``rules`` comes from `rules_of`; somebody who drives may look ``look_mm`` ahead.
    """
    walls, discs = outlines_of(mat)
    reach = _reach(rules, look_mm)
    frame = _obstacle_frame(walls, discs, reach, max(_FEW_OBSTACLE_CELLS, len(mat.starts) // 3))
    obstacles = Obstacles(
        segments=backend.allocate("Obstacles.segments", Buffer.of("float64", chain.from_iterable(walls), 4)),
        discs=backend.allocate("Obstacles.discs", Buffer.of("float64", chain.from_iterable(discs), 3)),
        frame=backend.allocate("Obstacles.frame", Buffer.of("float64", frame)),
        first=backend.zeros("Obstacles.first", (int(frame[3] * frame[4]) + 1,), "int32"),
        items=backend.zeros("Obstacles.items", (0,), "int32"),
        away=backend.zeros("Obstacles.away", (0,), "float32"),
    )
    backend.call("count_walls", reach, obstacles)
    count = int.from_bytes(backend.read(obstacles.first[-1:]), "little")
    obstacles = obstacles._replace(
        items=backend.zeros("Obstacles.items", (count,), "int32"),
        away=backend.zeros("Obstacles.away", (count,), "float32"),
    )
    backend.call("list_walls", reach, obstacles)
    return obstacles


def outlines_of(mat: Mat) -> tuple[list[_Wall], list[_Disc]]:
    """The walls, with the mat's edge and the sides of polygons, and the round obstacles, in whole µm."""
    walls = list(mat.walls)
    if mat.walled and mat.size_m:
        walls += _sides([(0.0, 0.0), (mat.size_m[0], 0.0), mat.size_m, (0.0, mat.size_m[1])])
    for polygon in mat.polygons:
        walls += _sides(polygon)
    return [_whole_um(wall) for wall in walls], [_whole_um(disc) for disc in mat.discs]


def _whole_um(lengths_m: Any) -> Any:
    return tuple(float(round(length_m * 1e6)) for length_m in lengths_m)


def _sides(corners: Sequence[tuple[float, float]]) -> list[_Wall]:
    return [(*here, *there) for here, there in zip(corners, (*corners[1:], corners[0]), strict=True)]


def _reach(rules: Rules, look_mm: int) -> float:
    """The most µm from which a wall or an obstacle can matter to a car."""
    farthest_look = max(*rules.levels.items[AVOID_RADII_MM : AVOID_RADII_MM + 4], look_mm) * 1000.0
    return float(max(farthest_look + rules.radius + LOOK_BEYOND_UM, rules.range * rules.line_of_sight))


def _obstacle_frame(walls: Sequence[_Wall], discs: Sequence[_Disc], reach: float, most_cells: int) -> list[float]:
    """Divide the rectangle within reach of walls and obstacles into square cells; as `Cells.frame` has it."""
    if not walls and not discs:
        return [0.0, 0.0, 0.0, 1.0, 1.0]
    boxes = [(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)) for x0, y0, x1, y1 in walls]
    boxes += [(x - radius, y - radius, x + radius, y + radius) for x, y, radius in discs]
    left, bottom = (min(box[side] for box in boxes) - reach - 1 for side in (0, 1))
    right, top = (max(box[side] for box in boxes) + reach + 1 for side in (2, 3))
    side = max(_OBSTACLE_CELL_UM, math.sqrt((right - left) * (top - bottom) / most_cells))
    # Nothing is within reach beyond the border cells, so their lists are empty, which is also right outside.
    columns, rows = (float(math.ceil(length / side) + 2) for length in (right - left, top - bottom))
    return [left - side, bottom - side, 1 / side, columns, rows]


def _check(profile: Profile, tick_ms: int, fastest_um: float, radius_um: float) -> None:
    body = profile.body
    if fastest_um > radius_um / 2:
        raise MotorcadeError(
            "cars-too-fast-for-tick", tick_ms=tick_ms, way=fastest_um / 1000, diameter=body.diameter_mm
        )
    if fastest_um > _LONGEST_WAY_UM:
        raise MotorcadeError(
            "way-in-tick-too-long", tick_ms=tick_ms, way=fastest_um / 1000, most=_LONGEST_WAY_UM // 1000
        )
    shortest_ms = air_us(0, profile.infrared.unit_us) / 1000
    if tick_ms >= shortest_ms:
        raise MotorcadeError("tick-longer-than-frame", tick_ms=tick_ms, shortest=shortest_ms)
    if body.ultrasonic_cone_deg >= 90:
        raise MotorcadeError("ultrasonic-cone-too-wide", profile=profile.name, cone=body.ultrasonic_cone_deg)
    if profile.servo.steering_deg >= 90:
        raise MotorcadeError("servo-steers-too-far", profile=profile.name, steering=profile.servo.steering_deg)


def _images(images: Sequence[bytes]) -> Any:
    words = [bytes_to_words(image) for image in images] or [(0,)]
    longest = max(len(list_of_words) for list_of_words in words)
    filled = chain.from_iterable((*list_of_words, *[0] * (longest - len(list_of_words))) for list_of_words in words)
    return Buffer.of("uint32", filled, longest)


@lru_cache(maxsize=256)
def _flips(rate: float) -> tuple[float, ...]:
    """The probability that at most k of 32 bits flip, times 2^32, computed exactly so that all machines agree."""
    exact = Fraction(rate)
    total = Fraction(0)
    chances = []
    for k in range(33):
        total += math.comb(32, k) * exact**k * (1 - exact) ** (32 - k)
        chances.append(float(math.floor(total * (1 << 32))))
    return tuple(chances)


def _cosine(degrees: float) -> float:
    return round(math.cos(math.radians(degrees)) * 2**40) / 2**40


def _floor_step(profile: Profile, fastest: float, turn: int) -> float:
    """How many µm a floor sensor moves at most in a tick: with its car, and around it."""
    # Wheel noise turns a car at most as fast as one wheel at full speed forward and the other backward.
    most_turn = max(turn / FULL_TURN * math.tau, 2 * fastest / (profile.body.wheel_base_mm * 1000))
    return float(math.ceil(fastest + _floor_reach(profile) * most_turn) + 2)


def _floor_reach(profile: Profile) -> float:
    """How far a floor sensor is from the middle of the car, in µm."""
    return math.hypot(profile.floor.ahead_mm, profile.floor.apart_mm / 2) * 1000


def _person_step(mat: Mat) -> float:
    """How many µm people walk at most in a tick; a person whose path starts again may jump to any place."""
    steps = [0.0]
    for person in mat.people:
        if person.repeats and person.path[0][1:] != person.path[-1][1:]:
            return FAR_UM
        for (t0, x0, y0), (t1, x1, y1) in zip(person.path, person.path[1:], strict=False):
            steps.append(math.hypot(x1 - x0, y1 - y0) / (t1 - t0) * 1000 * mat.tick_ms + 2)
    return max(steps)
