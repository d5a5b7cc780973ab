"""Random programs of a leader that decides, and random images of one, each by its number."""

from random import Random

from motorcade import (
    avoid,
    floor,
    follow_line,
    forward,
    led,
    left,
    pir,
    repeat,
    together,
    voice,
    wait,
)
from motorcade.program.conditions import All, AnyOf, Chance, Counted, Not, Sensing
from motorcade.program.flow_steps import Random as AnyNumber
from motorcade.program.flow_steps import (
    change_counter,
    do,
    forever,
    if_,
    repeat_until,
    set_counter,
    tell,
)
from motorcade.program.model import Followers, Program
from motorcade.words.flow import CALL, CHANCE, COUNT, COUNTER, FLOOR, IN_TURN, JUMP, RETURN, TELL, highest_level
from motorcade.words.formats import CONTROL, FLOW, STATE
from motorcade.words.image import Image, image_words


class DrawnLeader:
    """A random program: each list of steps begins with one that takes time."""

    def __init__(self, seed):
        self.random = Random(seed)
        self.functions = {}
        self.has_followers = self.random.random() < 0.5
        for name in ("f", "g")[: self.random.choice((0, 0, 1, 2))]:
            self.functions[name] = self.row(1)
        self.program = Program(self.row(2), self.followers(), functions=self.functions)

    def followers(self):
        if not self.has_followers:
            return None
        return Followers([led(0, 1), wait(2)])

    def sensed(self):
        kind = self.random.choice(["obstacle", "person", "floor", "voice"])
        made = Sensing(kind, self.random.randrange({"obstacle": 4, "person": 1, "floor": 4, "voice": 2}[kind]))
        return Not(made) if kind != "voice" and self.random.random() < 0.3 else made

    def condition(self, deep=2):
        kind = self.random.choice(["sensed", "sensed", "counted", "chance"] + ["not", "all", "any"] * (deep > 0))
        if kind == "counted":
            comparison = self.random.choice(["is", "below", "above"])
            return Counted(self.random.choice("ab"), comparison, self.random.randrange(4))
        if kind == "chance":
            return Chance(self.random.randint(1, 99))
        if kind == "not":
            return Not(self.condition(deep - 1))
        if kind in ("all", "any"):
            parts = tuple(self.condition(deep - 1) for _ in range(self.random.randint(1, 3)))
            return All(parts) if kind == "all" else AnyOf(parts)
        return self.sensed()

    def timed(self):
        random = self.random
        until = self.sensed() if random.random() < 0.5 else None

        def second():
            if until is not None and random.random() < 0.3:
                return None
            return random.choice((0, 1, 2, 3, 4, 5, 7, 15))

        kind = random.randrange(8)
        if kind == 0:
            return wait(second(), until=until)
        if kind == 1:
            return led(random.randrange(4), second(), until=until)
        if kind == 2:
            return avoid(random.randrange(4), second(), until=until)
        if kind == 3:
            return follow_line(second(), random.randint(1, 3), until=until)
        if kind == 4:
            return random.choice((pir, voice, floor))(second(), until=until)
        if kind == 5:
            parts = [led(random.randrange(4), second()), left(second()), avoid(1, second()), pir(), voice(), floor()]
            return together(*random.sample(parts, random.randint(0, 4)), until=until)
        return forward(second(), random.randrange(4), until=until)

    def told(self):
        return self.random.choice((led(0, 1), forward(3), together(led(1, 2), wait(3)), led(2, 1)))

    def row(self, deep):
        random = self.random

        def inner():
            return self.row(deep - 1)

        made = [self.timed()]
        for _ in range(random.randint(0, 3)):
            kind = random.randrange(12) if deep else random.randrange(3)
            if kind <= 2:
                made.append(self.timed())
            elif kind <= 4:
                made.append(if_(self.condition(), random.choice(([], inner(), inner())), random.choice(([], inner()))))
            elif kind <= 6:
                made.append(repeat(random.choice((1, 2, 3, 5, 300)), *inner()))
            elif kind == 7:
                made.append(repeat_until(self.condition(), *inner()))
            elif kind == 8:
                made.append(random.choice((change_counter, set_counter))(random.choice("ab"), random.randrange(3)))
            elif kind == 9:
                made.append(set_counter(random.choice("ab"), AnyNumber(random.randrange(4))))
            elif kind == 10:
                in_turn = self.has_followers and random.random() < 0.3
                made.append(tell("in_turn" if in_turn else self.told()))
            elif self.functions:
                made.append(do(random.choice(sorted(self.functions))))
            elif random.random() < 0.2:
                made.append(forever(*inner()))
        return made


def drawn_image(seed):
    """The words of an image that nobody has compiled."""
    random = Random(seed)
    count, followers = random.randint(1, 12), random.choice((0, 1, 3))
    is_tagged = followers > 0 and random.random() < 0.7
    leader = [
        drawn_state(random) if random.random() < 0.5 else drawn_flow_word(random, count, followers * is_tagged)
        for _ in range(count)
    ]
    told = [CONTROL.encode(accept_ir=1, led_which=random.randrange(2), led_duration=1) for _ in range(followers)]
    return image_words(Image(leader, told, random.randrange(8) if followers else -1, int(is_tagged), 1))


def drawn_state(random):
    until = random.randint(0, FLOOR)
    values = {"forward": 1, "led_which": random.randrange(4), "led_duration": random.randrange(4)}
    if random.random() < 0.7:
        values |= {"motor_enable": 1, "motor_direction": random.randrange(4), "motor_speed": random.randrange(4)}
        values |= {"motor_duration": random.randrange(4)}
    if until:
        values |= {
            "until": until,
            "until_not": random.randrange(2),
            "until_level": random.randint(0, highest_level(until)),
        }
    return STATE.encode(voice=random.randrange(2), **values)


def drawn_flow_word(random, leader_words, follower_words):
    op = random.choice((JUMP, JUMP, CALL, RETURN, COUNT, COUNT) + (TELL,) * (follower_words > 0))
    values = {"op": op}
    if op in (JUMP, CALL):
        condition = random.choice((0, random.randint(0, CHANCE)))
        values |= {"target": random.randrange(leader_words), "condition": condition}
        values |= {
            "if_not": random.randrange(2) * (condition > 0),
            "level": random.randint(0, highest_level(condition)),
        }
        if condition in (COUNTER, CHANCE):
            values |= {"counter": random.randrange(4), "value": random.choice((0, 1, 128, 255))}
    elif op == COUNT:
        values |= {"level": random.randrange(4), "counter": random.randrange(4), "value": random.randrange(3)}
    elif op == TELL:
        target = random.choice((IN_TURN, *range(follower_words)))
        values |= {"target": target, "value": random.randint(0, follower_words) * (target == IN_TURN)}
    return FLOW.encode(**values)
