"""Give random commands and events to one arbiter and to the limits of its commands, for conformance.py. Portable."""

from motorcade.car import arbiter
from motorcade.car.arbiter import EVENTS, STATES, Arbiter
from motorcade.car.drive_limits import DutyLimiter, duty_per_s
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import TICKS_MASK

SESSIONS = (1, 2, 3, 4)
OUTCOMES = ("applied", "watching", "needs neutral", "halted", "yielded", "unpowered")
ADVANCES_MS = ((0, 0), (1, 50), (1, 50), (300, 301), (4999, 5002))


def total_names():
    """Return the names of the cases that a run must meet at least once."""
    names = ["wheel handed over", "wheel waited for"]
    names += [f"car is {name}" for name, _ in STATES]
    names += [f"command {outcome}" for outcome in OUTCOMES]
    return names


class DrivenCar:
    """An arbiter and limits that get a random event in each step, and the record of their answers."""

    def __init__(self, random, record):
        self._random = random
        self._record = record
        self._now = TICKS_MASK - random.below(20000) if random.one_in(3) else random.below(TICKS_MASK + 1)
        self._arbiter = Arbiter(300, 5000, random.one_in(2))
        gain_per_s = 0 if random.one_in(3) else duty_per_s(random.between(1, 2000), 300, 255)
        self._limiter = DutyLimiter(gain_per_s, gain_per_s or 255, 255, 200, 6000, 7000)

    def step(self):
        random, record, car = self._random, self._record, self._arbiter
        low, high = random.pick(ADVANCES_MS)
        self._now = (self._now + random.between(low, high)) & TICKS_MASK
        record.add(car.tick(self._now))
        self._limit()
        session = random.pick(SESSIONS)
        event = random.below(len(EVENTS) + 1)
        if event in (arbiter.STILL, arbiter.MOVE) or random.one_in(2):
            speed = random.below(256) if event != arbiter.STILL else 0
            word = DRIVE.encode(angle=random.below(181), direction=random.below(2), speed=speed)
            record.count("command " + OUTCOMES[car.command(session, word, self._now)])
        elif event == len(EVENTS):
            record.count("wheel handed over" if car.request(session, self._now) else "wheel waited for")
        elif event == arbiter.STALL:
            car.stall()
        elif event == arbiter.RELEASE:
            car.release(session, self._now)
        elif event == arbiter.GONE:
            car.gone(session, self._now)
        elif event == arbiter.STOP:
            car.stop()
        elif event == arbiter.CLEAR:
            car.clear()
        elif event == arbiter.RESUME:
            record.add(car.resume(session, self._now))
        elif event == arbiter.LOW:
            car.discharge()
        elif event == arbiter.CHARGED:
            car.charge()
        record.add(car.may_switch(session, self._now))
        record.count("car is " + STATES[car.state][0])
        record.add(car.word, car.driver, car.wanted_by, car.commanded_ms)

    def _limit(self):
        random, record, limiter = self._random, self._record, self._limiter
        case = random.below(8)
        if case == 0:
            limiter.see_obstacle(random.below(400))
        elif case == 1:
            limiter.see_obstacle(None)
        elif case < 4:
            limiter.see_battery(random.between(5800, 6200) + 900 * limiter.is_low)
        elif case == 4:
            limiter.stop()
        record.add(limiter.next_duty(random.between(-255, 255), self._now))
        record.add(int(limiter.is_changing), int(limiter.is_low))
