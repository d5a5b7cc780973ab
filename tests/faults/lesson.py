"""A lesson in the simulated room: each answer of the class's server is compared with what a model of the class says.

One act follows another at a quiet network, so that each answer is known beforehand: of who is in the class, of who
isn't, of who was removed meanwhile. What goes wrong is what people do, a server that is killed between two acts, a
calendar that is set, and files that somebody has damaged. `tests.faults.class_room` has crowds, and disks that fail.
"""

import asyncio
import re
import ssl
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, TypeVar

from tests.faults import (
    lesson_cars,
    lesson_clashes,
    lesson_doors,
    lesson_files,
    lesson_heads,
    lesson_https,
    lesson_list,
    lesson_luck,
    lesson_mat,
    lesson_pairs,
    lesson_remote,
    lesson_report,
    lesson_strangers,
    lesson_studio,
    lesson_teacher,
    lesson_times,
    lesson_uploads,
    lesson_wall,
    lesson_work,
)
from tests.faults.browsers import DONE, Browser, SimulatedPage
from tests.faults.class_room import ClassComputer
from tests.faults.loop import SimulatedLoop, watch_memory
from tests.faults.room_cars import multicast_of
from tests.faults.system import Replaced, replaced
from tests.faults.world import Process, World

from motorcade.classroom.app import REQUESTS
from motorcade.errors import MotorcadeError
from motorcade.server.fleet import RemoteCar
from motorcade.server.running import url_of
from motorcade.service.requests import REQUESTS as STUDIO_REQUESTS

_ACTS, _TURNS = 34, 7
_MOST_WAITING_BYTES = 1 << 20
CABLE, CAR = "", lesson_cars.CAR
# Pages are sent a change at most so much later.
_SHOWN_S = 0.6
# Ages are shown every few seconds; a server that starts counts from its start on.
_SHOWN_LATE_S, _STARTS_S = 8.0, 3.0
_MARK = re.compile("# mark-[0-9]+-")
_SESSION_KEY = re.compile("[0-9a-f]{32}")
TABLE = (*REQUESTS, *STUDIO_REQUESTS)
WINDOWS = ("leader", "followers")
_T = TypeVar("_T")


class Pupil:
    """A pupil as the model knows it.

    Attributes:
        alike: names of the same likeness have the same.
        devices: the browsers that are in, the oldest first.
        projects, missions: by name the texts of all versions, the oldest first.
        news: what came and wasn't seen: its number, kind, name and sender.
        gifts_s: when the pupil gave something, or asked for a partner.
        opened: the mission of the world that the pupil opened last.
    """

    def __init__(self, answer: dict[str, Any], alike: str, browser: Browser) -> None:
        self.id, self.name, self.number, self.avatar = (answer[key] for key in ("id", "name", "number", "avatar"))
        self.alike = alike
        self.devices = [browser]
        self.draft: str | None = None
        self.draft_name = ""
        self.draft_s = 0.0
        self.draft_more: dict[str, Any] = {"place": "", "mission": None}
        self.projects: dict[str, list[str]] = {}
        self.missions: dict[str, list[str]] = {}
        self.news: list[tuple[int, str, str | dict[str, str], str]] = []
        self.told = 0
        self.mission: int | None = None
        self.hand = False
        self.hand_s = 0.0
        self.opened: str | None = None
        self.stars: dict[str, list[int]] = {}
        self.gifts_s: list[float] = []
        self.imported = False
        self.page: SimulatedPage | None = None
        self.pages: list[SimulatedPage] = []
        # Since when no page is connected.
        self.left_s = 0.0

    @property
    def browser(self) -> Browser:
        return self.devices[-1]

    def about(self) -> dict[str, str]:
        """What the pupil's own pages know of the pupil."""
        return {"id": self.id, "name": self.name, "avatar": self.avatar, "number": self.number}

    def tell(self, kind: str, name: str | dict[str, str], sender: str) -> None:
        """Something came."""
        self.told += 1
        self.news = [*self.news, (self.told, kind, name, sender)][-lesson_work.MOST_NEWS :]


class LessonPair:
    """Two pupils who program one project, as the model knows them."""

    def __init__(self, number: int, name: str, who: Pupil, to: Pupil) -> None:
        self.number, self.name = number, name
        self.members, self.joined = [who, to], [who]
        self.owners: dict[str, Pupil | None] = dict.fromkeys(WINDOWS, who)
        # Of each window the marks of all versions, the oldest first; and the mission that both play.
        self.texts: dict[str, list[str]] = {}
        self.mission = ""
        self.asks: Pupil | None = None
        # When somebody came in or went.
        self.changed_s = 0.0
        self.conducted: dict[str, Any] | None = None
        self.conducted_s = 0.0

    def open(self, mark: str) -> None:
        """Both windows hold what was opened."""
        self.texts = {window: [mark] for window in WINDOWS}

    @property
    def versions(self) -> dict[str, int]:
        return {window: len(texts) for window, texts in self.texts.items()}


class Lesson(ClassComputer):
    """One run: the computer, its people, and the model of the class."""

    def __init__(self, room: World) -> None:
        super().__init__(room)
        random = self.random
        self.has_camera = random.random() < 0.5
        self.cars = (RemoteCar(CAR, "car", 5005, camera=lesson_remote.CAMERA if self.has_camera else None),)
        # How many pictures the camera has taken; and what pages did with the car: what, who, and the car.
        self.pictures = 0
        self.log: list[tuple[str, str, str]] = []
        self.record = lambda did, who, car: self.log.append((did, who, car))
        self.limits = lesson_work.LIMITS
        # A lesson begins with a key in place of a password, now and then.
        self.has_password = random.random() < 0.7
        self.teacher = Browser(address="10.0.0.1")
        self.teacher.note = self._note_path
        self.signed_in = [self.teacher]
        # What the class's file has of it: digests of secrets, and until when.
        self.sign_ins: list[tuple[str, float]] = []
        self.pupils: list[Pupil] = []
        self.out: list[Pupil] = []
        # Browsers that were signed out, with a request and how it has to end.
        self.gone: list[tuple[Browser, str, str]] = []
        self.pairs: list[LessonPair] = []
        self.paired = self.joined = 0
        # Libraries of a pair that is being stored, and that nobody may come into any more.
        self.begun: set[str] = set()
        self.title, self.is_open, self.stuck_minutes = "", True, 5
        self.addresses = self.first_addresses()
        self.missions: list[dict[str, Any]] = []
        self.handed: int | None = None
        self.frozen = self.stopped = False
        self.holders: dict[str, Pupil | None] = {CABLE: None, CAR: None}
        self.mat = "closed"
        self.mat_entries: list[Pupil] = []
        self.mat_places = self.mat_followers = 0
        self.mat_plan: dict[str, Any] = {}
        self.mat_started_s = 0.0
        self.teachers_page: SimulatedPage | None = None
        self.library: dict[str, list[str]] = {}
        # When an address, and somebody of a likeness, has tried.
        self.tries_s: dict[str, list[float]] = {}
        self.wrong_numbers_s: dict[str, list[float]] = {}
        self.process = Process(room, "people", 0.001)
        self.network.link("people", 0.002)
        self.network.link("server", 0.001)
        # The real car, where it is switched on.
        self.car: Process | None = None
        self.board: Any = None
        self.control: Any = None
        self.car_is_stopped = False
        # A car of the teacher's list, and the last order to all of these.
        self.listed = lesson_list.ListedCar(self)
        self.ordered = ""
        # The program that the list has loaded since its server runs, by its checksum.
        self.loaded: dict[int, str] = {}
        # How many runs each page wanted whose trial had its turn.
        self.turns: list[int] = []
        # Who may see each mark.
        self.may_see: dict[str, set[str]] = {}
        self.whose: dict[Browser, Pupil] = {}
        # That browsers were given, each once.
        self.secrets: set[str] = set()
        self._marks = self._addresses = self.studios = 0
        self.studio_tls: ssl.SSLContext | None = None
        self._first_turn = _TURNS * int(room.seed.rpartition(" ")[2])
        # By how many there are.
        self._turns: Counter[int] = Counter()
        self._acts: list[tuple[float, Callable[[Lesson], Awaitable[None]]]] = [
            *lesson_doors.ACTS,
            *lesson_strangers.ACTS,
            *lesson_studio.ACTS,
            *lesson_https.ACTS,
            *lesson_times.ACTS,
            *lesson_pairs.ACTS,
            *lesson_work.ACTS,
            *lesson_uploads.ACTS,
            *lesson_teacher.ACTS,
            *lesson_mat.ACTS,
            *lesson_report.ACTS,
            *lesson_cars.ACTS,
            *lesson_remote.ACTS,
            *lesson_luck.ACTS,
            *lesson_list.ACTS,
            *lesson_wall.ACTS,
            *lesson_clashes.ACTS,
        ]

    def first_addresses(self) -> list[str]:
        """The addresses of a class's page, as a server has them that starts."""
        return [url_of(host, 7710) for host in self.hosts]

    # Whatever anybody asks.

    def new_browser(self, address: str = "") -> Browser:
        """A browser that nobody has used, at an address of its own unless one is given."""
        self._addresses += 1
        at = address or f"10.0.{1 + self._addresses // 200}.{1 + self._addresses % 200}"
        browser = Browser(lambda data: self.see(browser, data), at)
        browser.note = self._note_path
        return browser

    def is_connected(self, writer: asyncio.StreamWriter) -> bool:
        """Whether the server still has a connection."""
        own = writer.get_extra_info("sockname")
        transports = self.loop.transports() if self.loop else []
        return any(each.get_extra_info("peername") == own and not each.is_closing() for each in transports)

    def twin(self, browser: Browser) -> Browser:
        """Another tab of a browser."""
        tab = self.new_browser()
        tab.cookies = dict(browser.cookies)
        if browser in self.whose:
            self.whose[tab] = self.whose[browser]
        return tab

    def _note_path(self, path: str, outcome: str) -> None:
        """Note which route of the server was asked, and how that ended."""
        name = _SESSION_KEY.sub("{session}", path.partition("?")[0])
        self.world.asked.add((name, outcome))

    def see(self, browser: Browser, data: bytes) -> None:
        """A browser gets bytes: no work of others is in them."""
        if b"# mark-" not in data or browser in self.signed_in:
            return
        pupil = self.whose.get(browser)
        for mark in set(_MARK.findall(data.decode("utf-8", "replace"))):
            may = pupil is not None and pupil.id in self.may_see.get(mark, ())
            self.world.keep("work-of-others", may, "{} is sent {}", pupil and pupil.name, mark)

    def new_mark(self) -> str:
        """What no other text of the run contains."""
        self._marks += 1
        return f"# mark-{self._marks}-"

    def in_turn(self, some: Sequence[_T]) -> _T:
        """The next of some, which begin elsewhere with each seed: few seeds come to all."""
        count = len(some)
        self._turns[count] += 1
        return some[(self._first_turn + self._turns[count]) % count]

    def draw(self, some: list[Any]) -> Any:
        return self.random.choice(some) if some else None

    async def ask(self, browser: Browser, request: str, /, **message: Any) -> tuple[str, Any]:
        """Send a request, and check what every answer has to be."""
        before = lesson_files.secret_of(browser, "teacher")
        outcome, answer = self.answered(browser, request, *await browser.ask(request, **message))
        if outcome == DONE:
            lesson_files.note_teacher(self, browser, request, before)
        return outcome, answer

    def answered(self, browser: Browser, request: str, outcome: str, answer: Any) -> tuple[str, Any]:
        """Check what every answer has to be."""
        self.world.note(browser.address, request, outcome)
        self.world.asked.add((request, outcome))
        self.world.keep("no-traceback", outcome not in ("internal", "unknown", "no-json"), f"{request}: {outcome}")
        lesson_heads.check(self, browser, request, outcome)
        if outcome != DONE and isinstance(answer, dict):
            told = answer["error"]["sentence"]
            self.world.keep("says-why", bool(told.get("en") and told.get("zh")), f"{request}: no sentence")
        return outcome, answer

    async def expect(
        self, promise: str, browser: Browser, request: str, wanted: str | tuple[str, ...], /, **message: Any
    ) -> Any:
        """Send a request, which has to end in one of these ways; return the answer."""
        outcome, answer = await self.ask(browser, request, **message)
        allowed = (wanted,) if isinstance(wanted, str) else wanted
        self.world.keep(promise, outcome in allowed, "{} of {} {}: {}", request, browser.address, message, outcome)
        return answer if outcome == DONE else None

    # What there has to be.

    async def check_pages(self) -> None:
        """All pages show what there is."""
        await asyncio.sleep(_SHOWN_S)
        for pupil in self.pupils:
            if pupil.page:
                self._compare(pupil.name, pupil.page, "pupil", self._view_of(pupil, pupil.page))
        if self.teachers_page:
            self._compare("the teacher", self.teachers_page, "class", self._teachers_view(self.teachers_page))

    def _compare(self, who: str, page: SimulatedPage, kind: str, wanted: dict[str, Any]) -> None:
        self.world.keep("page-stays", not page.has_ended, f"{who}'s page has ended: {page.messages[-1:]}")
        shown = page.newest(kind) or {}
        wanted["is"] = kind
        keys = shown.keys() | wanted.keys()
        other = {key: (shown.get(key), wanted.get(key)) for key in keys if shown.get(key) != wanted.get(key)}
        self.world.keep("shows-what-is", not other, "{}: {}", who, other)

    def _shared_view(self, page: SimulatedPage) -> dict[str, Any]:
        holders = [{"name": name, "holder": pupil and pupil.id} for name, pupil in self.holders.items()]
        shown = page.newest("class") or page.newest("pupil") or {}
        # Its world goes on while somebody looks at it, and has an end.
        is_over = self.mat == "running" and self.world.now_s > self.mat_started_s + _STARTS_S
        mat = {
            "state": "over" if is_over and shown["mat"]["state"] == "over" else self.mat,
            **(self.mat_plan if self.mat != "closed" else {"mission": None, "title": {}}),
            "places": self.mat_places,
            "entries": [pupil.id for pupil in self.mat_entries],
        }
        # A server that starts looks at its ports within a second or so.
        cabled = self.world.now_s > self.started_s + _STARTS_S or shown.get("cabled")
        return {"frozen": self.frozen, "stopped": self.stopped, "shared": holders, "cabled": cabled, "mat": mat}

    def _view_of(self, pupil: Pupil, page: SimulatedPage) -> dict[str, Any]:
        fields = ("number", "kind", "name", "sender")
        return self._shared_view(page) | {
            "me": pupil.about(),
            "hand": pupil.hand,
            "mission": pupil.mission,
            "news": [dict(zip(fields, news, strict=True)) for news in pupil.news],
            "pair": self._pair_view(pupil),
        }

    def pair_of(self, pupil: Pupil) -> LessonPair | None:
        """The pair that a pupil is in, or is asked to come into."""
        return next((pair for pair in self.pairs if pupil in pair.members), None)

    def new_pair(self, name: str, who: Pupil, to: Pupil) -> LessonPair:
        """Begin a pair."""
        return LessonPair(self.paired, name, who, to)

    def is_away(self, pupil: Pupil) -> bool:
        return not pupil.pages and self.world.now_s - pupil.left_s >= 20.0

    def _pair_view(self, pupil: Pupil) -> dict[str, Any] | None:
        pair = self.pair_of(pupil)
        if pair is None:
            return None
        other = next((member for member in pair.members if member is not pupil), None)
        return {
            "id": str(pair.number),
            "name": pair.name,
            "partner": other and {key: getattr(other, key) for key in ("id", "name", "avatar")},
            "joined": pupil in pair.joined,
            "partner_joined": other in pair.joined,
            "partner_away": self._partner_away(pupil, pair, other),
            "owners": {window: owner and owner.id for window, owner in pair.owners.items()},
            "versions": pair.versions,
            "asks": pair.asks and pair.asks.id,
            "conducted": pair.conducted and pair.conducted | {"age_ms": self._age_ms(pupil, pair)},
        }

    def _age_ms(self, pupil: Pupil, pair: LessonPair) -> int | None:
        """What a page was told of how long ago the worlds were played; None where that can't be."""
        shown = pupil.page and pupil.page.newest("pupil")
        age_ms = int(shown["pair"]["conducted"]["age_ms"]) if shown and shown["pair"] else 0
        return age_ms if 0 <= age_ms <= (self.world.now_s - pair.conducted_s) * 1000 else None

    def _partner_away(self, pupil: Pupil, pair: LessonPair, other: Pupil | None) -> bool:
        if other is None or other not in pair.joined or other.pages:
            return False
        away_s = self.world.now_s - other.left_s
        if 19.0 < away_s < 22.0 or self.world.now_s < pair.changed_s + 2.0:
            # The class looks once a second.
            shown = pupil.page and pupil.page.newest("pupil")
            return bool(shown and shown["pair"] and shown["pair"]["partner_away"])
        return away_s > 20.0

    def _teachers_view(self, page: SimulatedPage) -> dict[str, Any]:
        shown = page.newest("class")
        rows = {row["id"]: row for row in shown["pupils"]} if shown else {}
        for pupil in self.pupils:
            row = rows.get(pupil.id, {})
            known = {
                **{key: getattr(pupil, key) for key in ("id", "name", "avatar", "number")},
                "online": bool(pupil.pages),
                "stars": sum(map(len, pupil.stars.values())),
                "mission": pupil.opened,
            }
            other = {key: (row.get(key), value) for key, value in known.items() if row.get(key) != value}
            self.world.keep("shows-what-is", not other, "the teacher's row of {}: {}", pupil.name, other)
            self.world.keep("shows-what-is", (row["hand_s"] is not None) == pupil.hand, f"{pupil.name}'s hand")
            self._check_age(f"since {pupil.name} raises a hand", row["hand_s"] or 0, pupil.hand and pupil.hand_s)
            self._check_age(f"since {pupil.name} is away", row["away_s"], not pupil.pages and pupil.left_s)
            stuck_s = row["stuck_s"]
            # The class looks once a second; a minute is the least that can be set.
            is_here = bool(pupil.pages) or self.world.now_s - pupil.left_s <= 1.0
            is_so = stuck_s is None or (bool(pupil.opened) and is_here and stuck_s >= 60)
            self.world.keep("shows-what-is", is_so, f"{pupil.name} is stuck: {row}")
        self.world.keep("shows-what-is", len(rows) == len(self.pupils), f"rows of {list(rows)}")
        own = {"title": self.title, "code": self.code, "is_open": self.is_open, "stuck_minutes": self.stuck_minutes}
        return self._shared_view(page) | own | {"disk": None, "pupils": list(rows.values())}

    def _check_age(self, what: str, shown_s: int, since_s: float | bool) -> None:
        """The teacher's page shows an age, at most some seconds later; 0 where there is none."""
        known_s = 0.0
        if since_s is not False:
            known_s = self.world.now_s - since_s
        is_so = known_s - _SHOWN_LATE_S <= shown_s <= known_s + _STARTS_S
        self.world.keep("shows-what-is", is_so, "{} s {}, not {}", shown_s, what, known_s)

    # What people do.

    async def live(self) -> None:
        """Do one act after the other, and compare all with the model."""
        await lesson_doors.begin(self)
        weights, acts = zip(*self._acts, strict=True)
        for _ in range(_ACTS):
            act = self.random.choices(acts, weights)[0]
            self.world.note("act", act.__name__)
            await act(self)
            if self.random.random() < 0.5:
                await self.check_pages()
            lesson_files.check(self)
            if self.board:
                is_held = (self.stopped or self.car_is_stopped) and self.board.speed
                self.world.keep("stop-holds", not is_held, "the car drives though all is stopped")
            await asyncio.sleep(self.random.uniform(0.05, 0.4))
        await lesson_times.end(self)
        await self.check_pages()
        lesson_files.check(self)
        self.world.is_over = True

    async def open_pages(self) -> None:
        """Open a page of the teacher, and of those pupils who have one."""
        self.teachers_page = (await self.teacher.open("teacher/stream")).follow()
        for pupil in self.pupils:
            if pupil.page:
                await self.open_page(pupil)

    async def open_page(self, pupil: Pupil) -> None:
        """Open a page of a pupil, which shows the class."""
        if pupil.page is None or pupil.page.has_ended:
            pupil.page = (await pupil.browser.open("class/stream")).follow()
            self.world.keep("page-stays", not pupil.page.refused, f"{pupil.name}'s page is refused")
            pupil.pages = [pupil.page]

    def refused(self, problem: MotorcadeError) -> None:
        self.world.keep("fails-closed", problem.code in ("class-damaged", "class-of-another-kind"), problem)

    def prepare(self) -> None:
        """Prepare the folder of the class."""
        if self.has_password:
            self.begin()
        else:
            self.first_key = "a-first-key"
            self.begin(stored="")
        self.disk.after = lambda: None

    write_report = staticmethod(lesson_report.write_report)

    def names(self) -> Replaced:
        own = lesson_work.names(self) | lesson_cars.names(self) | lesson_luck.names(self) | lesson_list.names(self)
        return super().names() | own | lesson_remote.names(self)


def run_lesson(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run = Lesson(room)
    with multicast_of(lesson_list.announced(run)), replaced(run.names()):
        run.prepare()
        run.supervise()
        if run.random.random() < 0.6:
            lesson_cars.start_car(run)
        SimulatedLoop(run.process, run.network).run(run.live)
        watch_memory(room, lambda: run.loop, _MOST_WAITING_BYTES)
        room.run(3000.0)
        room.keep("class-goes-on", room.is_over, "the last act never ended")
