"""The teacher and the pupils of the simulated class: what they ask, and what they were told."""

import asyncio
from random import Random
from typing import Any

from tests.faults.browsers import DONE, UNKNOWN, Browser
from tests.faults.loop import SimulatedLoop
from tests.faults.world import Process

PASSWORD = "correct horse"
_CANT_SAVE = ("cant-save", "class-not-stored", "undone-meanwhile", "library-full")


class Value:
    """Something that is stored: what was acknowledged last, and what was sent since without an answer."""

    def __init__(self, value: Any = None) -> None:
        self.known = value
        self.maybe: list[Any] = []

    def end(self, outcome: str, value: Any) -> None:
        """Note how a request ended that stores ``value``."""
        if outcome == DONE:
            self.known = value
        elif outcome == UNKNOWN:
            self.maybe.append(value)

    def allows(self, value: Any) -> bool:
        return value == self.known or value in self.maybe


class Member:
    """Somebody with a browser in a process of its own."""

    def __init__(self, run: Any, name: str) -> None:
        self.run = run
        self.name = name
        self.random = Random(f"{run.world.seed} {name}")
        self.process = Process(run.world, name, self.random.choice((0.001, 0.01)))
        self.browser = Browser(self.see)
        # What runs beside; a task that nothing refers to may be collected.
        self.tasks: list[asyncio.Task[None]] = []

    def see(self, data: bytes) -> None:
        """The server has sent this."""

    def start(self) -> None:
        SimulatedLoop(self.process, self.run.network).run(self.live)

    async def live(self) -> None:
        """Do what the member does, until the world ends."""
        raise NotImplementedError

    async def ask(self, request: str, /, **message: Any) -> tuple[str, Any]:
        """Send a request, and check what every answer has to be."""
        outcome, answer = await self.browser.ask(request, **message)
        self.run.world.note(self.name, request, outcome)
        self.run.world.keep("no-traceback", outcome != "internal", f"{request} answers 'internal'")
        return outcome, answer

    async def insist(self, request: str, /, **message: Any) -> Any:
        """Ask again and again until it is done; nothing is wrong any more, or soon will be."""
        for _ in range(40):
            outcome, answer = await self.ask(request, **message)
            if outcome == DONE:
                return answer
            if outcome == "teacher-session-needed":
                # On a full disk the teacher is signed in, but a server that is killed doesn't remember it.
                await self.ask("teacher/sign-in", password=PASSWORD)
            await asyncio.sleep(0.5)
        self.run.world.keep("class-goes-on", False, f"{self.name}: {request} answers {outcome}")
        return None


class PupilMember(Member):
    """A pupil: joins, works, saves, gives projects away, and tries what isn't allowed."""

    def __init__(self, run: Any, number: int) -> None:
        super().__init__(run, f"pupil {number}")
        self.number = number
        self.id = self.code_number = ""
        self.draft = Value("")
        self.projects: dict[str, Value] = {}
        # Whose work may be seen here: one's own, and what others have given.
        self.may_see = {self.mark}
        self.called = Value()
        self.has_left = False
        self._count = 0
        self.view: dict[str, Any] = {}

    @property
    def mark(self) -> bytes:
        """What this pupil's work contains, and nobody else's."""
        return f"work-of-{self.number}-".encode()

    def see(self, data: bytes) -> None:
        if b"work-of-" in data:
            for other in self.run.pupils:
                seen = other.mark in data and other.mark not in self.may_see
                self.run.world.keep("work-of-others", not seen, f"{self.name} is sent work of {other.name}")

    def new_work(self) -> dict[str, Any]:
        """A project that nobody else has."""
        self._count += 1
        return {
            "leader": {},
            "followers": None,
            "profile": "classroom",
            "python": f"# work-of-{self.number}-{self._count}",
        }

    async def live(self) -> None:
        run, random = self.run, self.random
        await asyncio.sleep(random.uniform(0.0, 0.3))
        await self._join()
        self.tasks.append(asyncio.create_task(self._watch()))
        while not run.world.is_healed:
            await random.choice((self._save_draft, self._save_draft, self._save, self._save, self._read, self._other))()
            await asyncio.sleep(random.uniform(0.2, 1.2))
        await self._check_all()
        run.has_checked.add(self.number)

    async def _join(self) -> None:
        while not self.id:
            outcome, answer = await self.ask("class/join", code=self.run.code, name=f"P{self.number}", avatar="bus")
            if outcome == DONE:
                self.id, self.code_number, self.called = answer["id"], answer["number"], Value(answer["name"])
            elif outcome == "nickname-taken":
                # The answer to an earlier request was lost: the teacher tells the number.
                pupil = self.run.stored_pupil(f"P{self.number}")
                if pupil:
                    await self._return(pupil.number)
            await asyncio.sleep(0.4)

    async def _return(self, number: str) -> None:
        code, name = self.run.code, self.called.known or f"P{self.number}"
        outcome, answer = await self.ask("class/return", code=code, name=name, number=number)
        if outcome == DONE:
            self.id, self.code_number = answer["id"], answer["number"]
            self.called.end(DONE, answer["name"])

    async def _watch(self) -> None:
        while True:
            try:
                await self.browser.listen("class/stream", self._take)
            except (OSError, EOFError):
                self.view = {}
            await asyncio.sleep(0.5)

    def _take(self, view: dict[str, Any]) -> None:
        if view.get("is") == "pupil":
            self.view = view
            self.run.world.keep("own-view", view["me"]["id"] == self.id, "the page of another pupil")

    async def _save_draft(self) -> None:
        work = self.new_work()
        outcome, _ = await self.ask("class/draft/write", name="draft", project=work)
        self.draft.end(outcome, work["python"])
        self._check_answer(outcome)

    async def _save(self) -> None:
        name, work = f"project {self.random.randrange(2)}", self.new_work()
        outcome, _ = await self.ask("projects/write", name=name, project=work)
        self.projects.setdefault(name, Value()).end(outcome, work["python"])
        self._check_answer(outcome)

    def _check_answer(self, outcome: str) -> None:
        known = (DONE, UNKNOWN, *_CANT_SAVE, "requests-too-fast", "class-frozen")
        self.run.world.keep("in-the-class", outcome in known, f"{self.name} is answered {outcome}")

    async def _read(self) -> None:
        if self.random.random() < 0.5:
            outcome, answer = await self.ask("class/draft/read")
            if outcome == DONE:
                self._check_draft(answer)
        else:
            for name in list(self.projects)[:1]:
                await self._check_project(name)

    def _check_draft(self, answer: dict[str, Any]) -> None:
        text = (answer["project"] or {}).get("python") or ""
        self.run.world.keep("answered-stays", self.draft.allows(text), f"{self.name}'s draft is {text!r}")

    async def _check_project(self, name: str) -> None:
        value = self.projects[name]
        outcome, answer = await self.ask("projects/read", name=name)
        if outcome == DONE:
            self.run.world.keep("answered-stays", value.allows(answer["python"]), f"{name} is {answer['python']!r}")
        elif outcome in ("no-project", "no-version"):
            self.run.world.keep("answered-stays", value.known is None, f"{name} is gone")

    async def _other(self) -> None:
        run, random = self.run, self.random
        what = random.randrange(6)
        if what == 0:
            outcome, _ = await self.ask(random.choice(("teacher/freeze", "teacher/settings", "teacher/stop-all")))
            run.world.keep("teacher-only", outcome in ("teacher-session-needed", UNKNOWN), outcome)
        elif what == 1:
            other = random.choice(run.pupils)
            path = random.choice((f"../{other.id}/draft", f"{other.id}/project 0", f"owners/{other.id}"))
            await self.ask("projects/read", name=path)
        elif what == 2:
            await self.ask("class/hand", raised=random.random() < 0.5)
        elif what == 3:
            await self._give()
        elif what == 4:
            await self.ask("class/take", name="", wants=random.random() < 0.7)
        else:
            await self._return_elsewhere()

    async def _give(self) -> None:
        other = self.random.choice([each for each in self.run.pupils if each is not self])
        if other.id and self.projects:
            # From the moment of the request on it may be there.
            other.may_see.add(self.mark)
            await self.ask("class/give", to=other.id, name=next(iter(self.projects)))

    async def _return_elsewhere(self) -> None:
        """Come back at another device, whose cookie is new."""
        before, self.browser = self.browser, Browser(self.see)
        code = self.run.code
        outcome, answer = await self.ask("class/return", code=code, name=self.called.known, number=self.code_number)
        if outcome == DONE:
            self.run.world.keep("own-view", answer["id"] == self.id, f"{answer['id']} instead of {self.id}")
            before.hang_up()
        else:
            self.browser = before

    async def _check_all(self) -> None:
        """Nothing is wrong any more: what was answered is there."""
        # A name that can't be stored is shown until that is known.
        before = list(self.called.maybe)
        about = await self.insist("class/about")
        self.run.world.keep("answered-stays", bool(about["me"]), f"{self.name} is no longer in the class")
        name = about["me"]["name"]
        self.run.world.keep("answered-stays", name in before or self.called.allows(name), name)
        self._check_draft(await self.insist("class/draft/read"))
        for name, value in self.projects.items():
            if value.known is not None:
                answer = await self.insist("projects/read", name=name)
                self.run.world.keep("answered-stays", value.allows(answer["python"]), f"{name}: {answer['python']!r}")


class TeacherMember(Member):
    """The teacher: signs in, renames, hands out, freezes and stops."""

    def __init__(self, run: Any) -> None:
        super().__init__(run, "teacher")
        self.title = Value("")

    async def live(self) -> None:
        run, random = self.run, self.random
        await self.insist("teacher/sign-in", password=PASSWORD)
        while not run.world.is_healed:
            await random.choice((self._rename, self._stop, self._stop, self._set_title, self._hand_out))()
            await asyncio.sleep(random.uniform(0.2, 1.0))
        await self.insist("teacher/release-all")
        await self.insist("teacher/freeze", frozen=False)
        while len(run.has_checked) < len(run.pupils):
            await asyncio.sleep(0.2)
        run.world.is_over = True

    async def _rename(self) -> None:
        pupil = self.random.choice(self.run.pupils)
        if pupil.id:
            name = f"N{self.random.randrange(10_000)}"
            # Until the answer is there, both names may be.
            pupil.called.maybe.append(name)
            outcome, _ = await self.ask("teacher/rename", pupil=pupil.id, name=name)
            if outcome == DONE:
                pupil.called.end(DONE, name)
            elif outcome in _CANT_SAVE:
                pupil.called.maybe.remove(name)

    async def _set_title(self) -> None:
        title = f"T{self.random.randrange(10_000)}"
        outcome, _ = await self.ask("teacher/settings", title=title)
        self.title.end(outcome, title)

    async def _hand_out(self) -> None:
        project = {"leader": {}, "followers": None, "profile": "classroom", "python": "# handed out"}
        await self.ask("teacher/hand-out", name="task", project=project)

    async def _stop(self) -> None:
        """Stop all cars, or freeze all pages: a pupil's page at a good network shows it at once."""
        run, witness = self.run, self.run.pupils[0]
        request, field = self.random.choice((("teacher/stop-all", "stopped"), ("teacher/freeze", "frozen")))
        is_calm = run.is_calm() and bool(witness.view)
        asking = asyncio.create_task(self.ask(request, **({"frozen": True} if field == "frozen" else {})))
        await asyncio.sleep(1.0)
        if is_calm and run.is_calm() and witness.view:
            run.world.keep("stop-gets-through", bool(witness.view.get(field)), f"{request} after 1 s")
        await asking
        await (self.ask(request, frozen=False) if field == "frozen" else self.ask("teacher/release-all"))


class ClassStranger(Member):
    """Somebody in the network with no code: opens connections, guesses, sends nonsense."""

    async def live(self) -> None:
        self.run.world.count("stranger")
        await asyncio.sleep(self.random.uniform(0.2, 2))
        browsers = [Browser(self.see) for _ in range(30)]
        for browser in browsers:
            self.tasks.append(asyncio.create_task(self._bother(browser)))
        await asyncio.sleep(60)

    async def _bother(self, browser: Browser) -> None:
        mute = self.random.random() < 0.8
        if mute:
            try:
                _, writer = await asyncio.open_connection("server", 7710)
            except OSError:
                return
            writer.write(self.random.choice((b"", b"POST /api/class/join HTTP/1.1\r\nHost: x", b"\x16\x03\x01")))
            await asyncio.sleep(60)
            return
        for _ in range(3):
            request = self.random.choice(("class/join", "teacher/sign-in", "projects/list", "class/return"))
            outcome, _ = await browser.ask(
                request, code="AAAAAA", name="X", avatar="bus", number="0000", password="x" * 8
            )
            self.run.world.keep("strangers-stay-out", outcome != DONE, request)
            await asyncio.sleep(0.5)
