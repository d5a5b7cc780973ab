"""A second, simple implementation of the engine's world: the loop of a real car on simulated boards, all pairs checked.

It is slow, and it is the oracle for `motorcade.engine.kernels`: both share the brain, the step, the figures of the
layout and plane geometry, but none of the methods that make the kernels fast.
"""

import math
from dataclasses import dataclass, field, replace

from motorcade.car import decisions
from motorcade.car.board import Board
from motorcade.car.brain import LEFT, RIGHT, STARTED_MS, STATE, WORD
from motorcade.car.loop import Car
from motorcade.config.profile import Profile
from motorcade.engine import layout
from motorcade.engine.backend import allocate_all
from motorcade.engine.events import KINDS, LOSS_REASONS, NEXT_WORD
from motorcade.engine.geometry import FULL_TURN, NORMALS, cross, is_shaded, mix
from motorcade.engine.native import InterpretedKernels
from motorcade.mats import Mat, Pose
from motorcade.mats.plane import nearest_of_segment
from motorcade.words.infrared import air_us, check_is_good, is_remote_control, ones, tag_of
from support import plain_senses

BY_COLLISION, BY_SENDING = "collision", "sending"


@dataclass
class Frame:
    """A frame on the air; ``alive`` are the cars that can still receive it, ``reaches`` all with their distances."""

    sender: int
    bits: int
    end_ms: int
    reaches: dict[int, int] = field(default_factory=dict)
    alive: set[int] = field(default_factory=set)


class PlainBoard(Board):
    """The board of one car."""

    def __init__(self, world: "PlainWorld", index: int, image: bytes | None):
        self._world, self._image = world, image
        self.index = index
        self.number = (world.seed * 1_000_003 + index) & 0xFFFFFFFF
        self.is_leader = image is not None
        self.levels = tuple(world.rules.levels.tolist())
        self.direction, self.speed_level, self.led = 0, 0, 4
        self.outbox: int | None = None
        self.inbox: list[tuple[int, int]] = []
        self.senders: list[int] = []

    def now_ms(self) -> int:
        return self._world.now_ms

    def load_image(self) -> bytes | None:
        return self._image

    def received_frames(self) -> list[int]:
        inbox, self.inbox = self.inbox, []
        self.senders = [sender for _, sender in inbox]
        return [bits for bits, _ in inbox]

    def senses_carrier(self) -> bool:
        return any(self.index in frame.reaches for frame in self._world.on_air)

    def is_sending(self) -> bool:
        return any(frame.sender == self.index for frame in self._world.on_air)

    def send_frame(self, frame: int) -> None:
        self.outbox = frame

    def obstacle_mm(self) -> int:
        return plain_senses.obstacle_mm(self._world, self.index)

    def sees_person(self) -> bool:
        return plain_senses.sees_person(self._world, self.index)

    def dark_floor(self) -> int:
        return plain_senses.dark_floor(self._world, self.index)

    def heard_voice(self) -> int:
        return plain_senses.voice_at(self._world, self.index)

    def set_wheels(self, direction: int, speed_level: int) -> None:
        self.direction, self.speed_level = direction, speed_level
        if self.index not in self._world.driven:
            self._world.set_way(self.index)

    def set_led(self, which: int) -> None:
        self.led = which

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        why, other = "", 0
        if kind in ("state", "start"):
            other = int(detail)
        elif kind in ("heard", "lost"):
            why, other = str(detail) if kind == "lost" else "", self.senders[0]
        self._world.record(at_ms, self.index, kind, why, word, other)


class PlainCar(Car):
    """A car whose decisions are noted, but for those of a tick that leads to no state."""

    def __init__(self, board: PlainBoard, world: "PlainWorld"):
        super().__init__(board)
        self.index = board.index
        self.world = world

    def note_end(self) -> None:
        self.world.record(self._now_ms, self.index, "over", "", self.memory[WORD], self.memory[STATE])

    notes_flow = 1

    def note_flow(self, index: int) -> None:
        events, car = self.world.events, self.index
        at_ms, word = self.memory[STARTED_MS], self.image[1 + index]
        following = self.decisions[decisions.NEXT]
        self.world.record(at_ms, car, "flow", "", word, index + NEXT_WORD * following)
        if self.decisions[decisions.FLOW_LEFT] == 0:
            while events and events[-1][:3] == (at_ms, car, KINDS.index("flow")):
                events.pop()


class PlainWorld:
    """One world of cars."""

    def __init__(self, mat: Mat, images: list[bytes], profile: Profile, seed: int = 0):
        self.mat, self.images, self.profile, self.seed = mat, images, profile, seed
        self.rules = allocate_all(InterpretedKernels(), layout.rules_of(mat, profile, images))
        self.walls, self.discs = layout.outlines_of(mat)
        starts = mat.starts
        self.x = [round(each * 1e6) for each in starts.x_m.tolist()]
        self.y = [round(each * 1e6) for each in starts.y_m.tolist()]
        self.heading = [round(each / math.tau * FULL_TURN) % FULL_TURN for each in starts.heading.tolist()]
        self.way: list[tuple[int, ...]] = [(0, 0)] * len(starts)
        self.driven: dict[int, tuple[float, float, float]] = {}
        self.turned: dict[int, int] = {}
        self.loudest = [0] * len(starts)
        self.events: list[tuple[int, int, int, int, int, int]] = []
        self.on_air: list[Frame] = []
        self.begun: list[Frame] = []
        self.undetected = self.touching_ms = self.tick = 0
        self.said = 0
        leaders = iter(range(len(starts)))
        programs = [images[next(leaders) % len(images)] if leads else None for leads in starts.leads]
        self.boards = [PlainBoard(self, index, image) for index, image in enumerate(programs)]
        self.cars = [PlainCar(board, self) for board in self.boards]

    @property
    def now_ms(self) -> int:
        return self.tick * self.mat.tick_ms

    def record(self, at_ms: int, car: int, kind: str, why: str, word: int, other: int) -> None:
        self.events.append((at_ms, car, KINDS.index(kind), LOSS_REASONS.index(why), word, other))

    def run(self, duration_ms: int) -> None:
        for _ in range(duration_ms // self.mat.tick_ms):
            self.step()

    def say(self, word: str) -> None:
        self.said = layout.VOICES[word]

    def set_environment(self, mat: Mat, range_mm: int) -> None:
        self.mat = replace(mat, starts=self.mat.starts, tick_ms=self.mat.tick_ms)
        self.profile = replace(self.profile, infrared=replace(self.profile.infrared, range_mm=range_mm))
        self.rules = allocate_all(InterpretedKernels(), layout.rules_of(self.mat, self.profile, self.images))
        self.walls, self.discs = layout.outlines_of(self.mat)
        # With wheel noise each tick sets the way anew.
        for car in range(len(self.cars) if self.rules.wheel_noise == 0 else 0):
            self.set_way(car)

    def move(self, car: int, pose: Pose) -> None:
        self.x[car], self.y[car] = round(pose.x * 1e6), round(pose.y * 1e6)
        self.heading[car] = round(pose.heading / math.tau * FULL_TURN) % FULL_TURN
        self.set_way(car)

    def drive(self, car: int, angle_deg: int, direction: int, speed: int) -> None:
        duty = speed / self.profile.motor.pwm_max
        way = duty * self.profile.speeds_mm_s[3] * self.mat.tick_ms * (1 if direction else -1)
        steered = math.tan(math.radians(self.profile.servo.steering_deg * (angle_deg - 90) / 90))
        slip = math.atan(steered / 2)
        turn = way * math.cos(slip) * steered / (self.profile.body.wheel_base_mm * 1000)
        parts = way * math.cos(slip) * 4096, way * math.sin(slip) * 4096, turn / math.tau * FULL_TURN
        # Slightly more before truncation, because sines and tangents are rounded differently.
        ahead, aside = (math.trunc(part + math.copysign(1e-6, part)) for part in parts[:2])
        self.driven[car] = (ahead, aside, round(parts[2]))

    def give_back(self, car: int) -> None:
        if self.driven.pop(car, None):
            self.way[car] = (0, 0)
            self.set_way(car)

    def step(self) -> None:
        for car in self.driven:
            self._set_out(car)
        self._deliver()
        for each in self.cars:
            each.tick()
        pushes = [self._push(index) for index in range(len(self.cars))]
        self.begun = self._begin()
        for frame in self.begun:
            self._spread(frame)
        self._move(pushes)
        self.said = 0
        self.tick += 1

    # The air

    def _deliver(self) -> None:
        for frame in [frame for frame in self.on_air if frame.end_ms <= self.now_ms]:
            self.on_air.remove(frame)
            for receiver in frame.alive:
                bits = self._flipped(frame.bits, receiver)
                if (
                    bits != frame.bits
                    and ones(bits) % 2 == 0
                    and not is_remote_control(bits)
                    and (check_is_good(bits) if tag_of(bits) else not bits & 0x7FE)
                ):
                    self.undetected += not self._is_deaf(receiver)
                self.boards[receiver].inbox.append((bits, frame.sender))

    def _is_deaf(self, car: int) -> bool:
        from motorcade.car import brain

        memory = list(self.cars[car].memory)
        brain.follower_step(memory, self.now_ms, self.boards[car].levels)
        return bool(memory[brain.RUNNING]) and not memory[brain.WORD] >> 31

    def _flipped(self, bits: int, receiver: int) -> int:
        chance = mix(self.seed ^ 0x5F3759DF, receiver, self.now_ms)
        wanted = sum(chance >= bound for bound in self.rules.flips[:32])
        places: list[int] = []
        turn = 0
        while len(places) < wanted:
            turn += 1
            place = mix(self.seed + turn, receiver, self.now_ms) >> 27
            if place not in places:
                places.append(place)
        return bits ^ sum(1 << place for place in places)

    def _begin(self) -> list[Frame]:
        begun = []
        for board in self.boards:
            if board.outbox is not None:
                air_ms = -(-air_us(board.outbox, self.profile.infrared.unit_us) // 1000)
                begun.append(Frame(board.index, board.outbox, self.now_ms + air_ms))
                board.outbox = None
                for other in self.on_air:
                    if board.index in other.alive:
                        self._lose(other, board.index, BY_SENDING)
        return begun

    def _lose(self, frame: Frame, receiver: int, why: str) -> None:
        frame.alive.discard(receiver)
        self.record(self.now_ms, receiver, "lost", why, frame.bits, frame.sender)

    def _spread(self, frame: Frame) -> None:
        self.on_air.append(frame)
        for receiver, board in enumerate(self.boards):
            if receiver == frame.sender:
                continue
            distance = self._reaches(frame.sender, receiver)
            if distance is None:
                continue
            others = [other for other in self.on_air if other is not frame and receiver in other.reaches]
            if not others:
                self.loudest[receiver] = distance
            loudest = self.loudest[receiver]
            self.loudest[receiver] = min(loudest, distance)
            if board.is_leader:
                pass  # It receives no frames; it only finds that the air is busy.
            elif self._sends_soon(receiver):
                self._lose(frame, receiver, BY_SENDING)
            else:
                for other in others:
                    if receiver in other.alive and not self._beats(loudest, distance):
                        self._lose(other, receiver, BY_COLLISION)
                if others and not self._beats(distance, loudest):
                    self._lose(frame, receiver, BY_COLLISION)
                else:
                    frame.alive.add(receiver)
            frame.reaches[receiver] = distance

    def _sends_soon(self, car: int) -> bool:
        """Whether the car sends, or begins to send in this tick."""
        return any(frame.sender == car for frame in (*self.on_air, *self.begun))

    def _beats(self, distance: int, other: int) -> bool:
        if self.rules.capture == 0 or other == distance:
            return False
        return other * other >= self.rules.capture * distance * distance

    def _reaches(self, sender: int, receiver: int) -> int | None:
        """The distance that a frame of ``sender`` travels to ``receiver``; None where it doesn't arrive."""
        dx, dy = self.x[receiver] - self.x[sender], self.y[receiver] - self.y[sender]
        distance = math.sqrt(dx * dx + dy * dy)
        if dx * dx + dy * dy > self.rules.range**2:
            return None
        ahead = plain_senses.ahead_of(self.heading[sender])
        if dx * ahead[0] + dy * ahead[1] < self.rules.beam_cos * distance:
            return None
        return None if self.rules.line_of_sight and self._is_hidden(sender, receiver) else int(distance)

    def _is_hidden(self, sender: int, receiver: int) -> bool:
        line = (self.x[sender], self.y[sender], self.x[receiver], self.y[receiver])
        shades = [(x, y, self.rules.radius) for x, y in zip(self.x, self.y, strict=True)]
        shades = [disc for index, disc in enumerate(shades) if index not in (sender, receiver)]
        return any(is_shaded(*line, *disc) for disc in (*shades, *self.discs)) or any(
            cross(*line, *wall) for wall in self.walls
        )

    # Bodies

    def set_way(self, car: int) -> None:
        if self.rules.coast:
            # It changes when the car moves.
            return
        board = self.boards[car]
        speed = 0.0 if board.direction in (LEFT, RIGHT) else float(self.rules.speeds[board.speed_level])
        self._drive(car, speed)

    def _drive(self, car: int, speed: float) -> None:
        along = plain_senses.ahead_of(self.heading[car])
        self.way[car] = tuple(math.floor(speed * 4096 * each + 0.5) for each in along)

    def _set_out(self, car: int) -> None:
        ahead, aside, turn = self.driven[car]
        if self.rules.wheel_noise and ahead:
            left, right = self._slips(car)
            share = (left + right) / 2
            turn = math.floor(turn * share + (right - left) * ahead / 4096 * self.rules.wheel_turn + 0.5)
            ahead, aside = ahead * share, aside * share
        self.turned[car] = int(turn)
        heading = self.heading[car] + int(turn) // 2
        along = plain_senses.ahead_of(heading)
        way = ahead * along[0] - aside * along[1], ahead * along[1] + aside * along[0]
        self.way[car] = tuple(math.floor(each + 0.5) for each in way)

    def is_stuck(self, car: int) -> bool:
        """Whether bodies and walls will take more than three quarters of its way from the car in the next tick."""
        touching_ms = self.touching_ms
        push_x, push_y = self._push(car)
        self.touching_ms = touching_ms
        way_x, way_y = self.way[car][0] / 4096, self.way[car][1] / 4096
        return (way_x + push_x) * way_x + (way_y + push_y) * way_y < (way_x * way_x + way_y * way_y) / 4

    def _push(self, car: int) -> tuple[int, int]:
        if not self.mat.physics.collisions:
            return 0, 0
        dx: float
        dy: float
        push_x: float = 0
        push_y: float = 0
        x, y = self.x[car], self.y[car]
        for other in range(len(self.cars)):
            dx, dy = self.x[other] - x, self.y[other] - y
            distance = math.sqrt(dx * dx + dy * dy)
            if other != car and distance < self.rules.contact:
                share = self.rules.contact - distance
                if distance == 0:
                    dx, distance = (1 if car < other else -1), 1
                push_x -= math.floor(dx * share / (2 * distance) + 0.5)
                push_y -= math.floor(dy * share / (2 * distance) + 0.5)
        away_x, away_y, pressed_along = 0, 0, []
        touched = 0
        points = [(*nearest_of_segment(x, y, *wall), 0.0) for wall in self.walls]
        for to_x, to_y, radius in (*points, *self.discs):
            dx, dy = to_x - x, to_y - y
            distance = math.sqrt(dx * dx + dy * dy)
            if distance > 0 and distance - radius < self.rules.radius:
                share = (self.rules.radius - (distance - radius)) / distance
                away_x -= math.floor(dx * share + 0.5)
                away_y -= math.floor(dy * share + 0.5)
                touched += 1
                into = (push_x * dx + push_y * dy) / (dx * dx + dy * dy)
                if into > 0:
                    pressed_along.append((push_x - into * dx, push_y - into * dy))
        if pressed_along:
            push_x, push_y = pressed_along[0] if touched == 1 else (0, 0)
        push_x, push_y = math.floor(push_x + 0.5) + away_x, math.floor(push_y + 0.5) + away_y
        if push_x or push_y:
            self.touching_ms += self.mat.tick_ms
        return self._bounded(car, push_x, push_y) if push_x or push_y else (0, 0)

    def _bounded(self, car: int, push_x: float, push_y: float) -> tuple[int, int]:
        way_x, way_y = self.way[car][0] / 4096, self.way[car][1] / 4096
        length = math.sqrt((way_x + push_x) * (way_x + push_x) + (way_y + push_y) * (way_y + push_y))
        if length > self.rules.fastest:
            push_x = (way_x + push_x) * self.rules.fastest / length - way_x
            push_y = (way_y + push_y) * self.rules.fastest / length - way_y
        return int(min(max(push_x, -32000), 32000)), int(min(max(push_y, -32000), 32000))

    def _move(self, pushes: list[tuple[int, int]]) -> None:
        for car, board in enumerate(self.boards):
            wheels = board.direction * 4 + board.speed_level
            if car in self.driven:
                self.heading[car] = (self.heading[car] + self.turned[car]) % FULL_TURN
            elif not self.rules.wheel_noise:
                self.heading[car] = (self.heading[car] + int(self.rules.turns[wheels])) % FULL_TURN
            elif board.speed_level:
                self._slip(car, wheels)
            else:
                self.way[car] = tuple(math.trunc(part * self.rules.coast) for part in self.way[car])
            if self.rules.wheel_noise and any(pushes[car]):
                pushes[car] = self._bounded(car, *pushes[car])
            step = [(part * (self.tick + 1) >> 12) - (part * self.tick >> 12) for part in self.way[car]]
            self.x[car] += step[0] + pushes[car][0]
            self.y[car] += step[1] + pushes[car][1]

    def _slip(self, car: int, wheels: int) -> None:
        left, right = self._slips(car)
        spin = float(self.rules.turns[wheels]) / self.rules.wheel_turn / 2
        speed = 0.0 if wheels >> 2 in (LEFT, RIGHT) else float(self.rules.speeds[wheels & 3])
        left, right = left * (speed - spin), right * (speed + spin)
        turned = math.floor((right - left) * self.rules.wheel_turn + 0.5)
        self.heading[car] = (self.heading[car] + turned) % FULL_TURN
        self._drive(car, (left + right) / 2)

    def _slips(self, car: int) -> list[float]:
        bits = mix(self.seed, car, self.now_ms // 100)
        return [1 + self.rules.wheel_noise * float(NORMALS[bits >> low & 1023]) for low in (0, 10)]
