"""Bound how often secrets are guessed (personal numbers, passwords) and how many join; notice who guesses codes."""

import ipaddress
import math
from collections import OrderedDict, deque

from motorcade.errors import MotorcadeError

_MOST_WHO = 4096


def guesser(address: str) -> str:
    """Whom tries from an address count for; one computer may have all the addresses of an IPv6 network."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if found.version == 4:
        return str(found)
    return str(found.ipv4_mapped or ipaddress.ip_network((int(found) >> 64 << 64, 64)))


class Attempts:
    """Count attempts, such as wrong numbers: of one address, and in all.

    Who has made too many has to wait, whether or not the next one would be right. Where there were too many in all, who
    has made none still has one attempt: so somebody who guesses from many addresses doesn't lock others out, and gets
    one guess for each address.

    Args:
        most_of_one: how many one guesser may make in a window.
        most: how many all may make in a window, before one wrong attempt is too many.
        window_s: the length of the window.
        code: of the error where there are too many.
    """

    def __init__(self, most_of_one: int, most: int, window_s: float, code: str = "too-many-attempts") -> None:
        self._code = code
        self._most_of_one = most_of_one
        self._window_s = window_s
        self._all_s: deque[float] = deque(maxlen=most)
        self._by_guesser: OrderedDict[str, deque[float]] = OrderedDict()

    def check(self, who: str, now_s: float) -> None:
        """Raise MotorcadeError, with the seconds to wait, where ``who`` has made too many."""
        times_s = self._by_guesser.get(who, deque())
        while times_s and now_s - times_s[0] >= self._window_s:
            times_s.popleft()
        too_many = len(self._all_s) == self._all_s.maxlen and now_s - self._all_s[0] < self._window_s
        if len(times_s) >= (1 if too_many else self._most_of_one):
            wait_s = math.ceil(self._window_s - (now_s - times_s[0]))
            raise MotorcadeError(self._code, seconds=max(wait_s, 1))

    def add(self, who: str, now_s: float) -> None:
        """Count an attempt."""
        self._by_guesser.setdefault(who, deque(maxlen=self._most_of_one)).append(now_s)
        self._by_guesser.move_to_end(who)
        if len(self._by_guesser) > _MOST_WHO:
            self._by_guesser.popitem(last=False)
        self._all_s.append(now_s)


class NumberAttempts:
    """Count wrong personal numbers in five minutes: of one address for one name, and of one address for all names.

    Tablets behind one router have the same address: five wrong numbers for one name keep nobody else out there.
    """

    def __init__(self) -> None:
        self._for_one_name = Attempts(5, 30, 300.0)
        self._for_all_names = Attempts(20, 60, 300.0)

    def check(self, who: str, name: str, now_s: float) -> None:
        """Raise MotorcadeError, with the seconds to wait, where ``who`` has made too many."""
        self._for_one_name.check(f"{who} {name}", now_s)
        self._for_all_names.check(who, now_s)

    def add(self, who: str, name: str, now_s: float) -> None:
        """Count a wrong number for a name."""
        self._for_one_name.add(f"{who} {name}", now_s)
        self._for_all_names.add(who, now_s)


class Guesses:
    """Tell when so many wrong attempts were made, by whomever, that somebody guesses. Nobody has to wait.

    Args:
        most: how many are too many in a window.
        window_s: the length of the window.
    """

    def __init__(self, most: int, window_s: float) -> None:
        self._window_s = window_s
        self._times_s: deque[float] = deque(maxlen=most)

    def add(self, now_s: float) -> bool:
        """Count an attempt; return whether it is one too many."""
        self._times_s.append(now_s)
        return len(self._times_s) == self._times_s.maxlen and now_s - self._times_s[0] < self._window_s

    def clear(self) -> None:
        """Forget all."""
        self._times_s.clear()
