"""Two pupils who program one project: one has the leader's window, the other the followers'. Without I/O.

A window has one owner, who alone stores it; the files are those of a library of the pair's own, with versions. Each
page plays a world of its own: the same program, mat and seed give the same run to the bit, so only how it is played is
passed on, and how long ago that was: a page that comes later catches up.
"""

from msgspec import structs

from motorcade.classroom.messages import Classmate, Conducted, PairView, Window, request
from motorcade.classroom.record import WINDOWS, Pair, leave_pair
from motorcade.classroom.room import Classroom, for_all
from motorcade.errors import MotorcadeError
from motorcade.service.world_messages import Milliseconds, Seed, Speed

# A partner who is away for so long may lose a window: a tablet that sleeps must not hold up the other one.
AWAY_S = 20.0


class Pairs:
    """The pairs of a class.

    Args:
        room: the class.

    Attributes:
        versions: of the windows that were stored, by the pair's id and the window.
    """

    def __init__(self, room: Classroom) -> None:
        self._room = room
        self.versions: dict[tuple[str, Window], int] = {}
        # With the time at which it was said.
        self._conducted: dict[str, tuple[float, Conducted]] = {}
        self._away: set[str] = set()

    def of(self, pupil: str) -> Pair | None:
        """Return the pair that a pupil is in, or is asked to come into."""
        return next((pair for pair in self._room.record.pairs if pupil in pair.members), None)

    def joined(self, pupil: str, pair_id: str | None = None) -> Pair:
        """Return the pair that a pupil is in. Raises MotorcadeError, also where it has gone on from ``pair_id``."""
        pair = self.of(pupil)
        if pair is None or pupil not in pair.joined:
            raise MotorcadeError("not-in-a-pair")
        if pair_id not in (None, pair.id):
            raise MotorcadeError("pair-went-on")
        return pair

    def view(self, pupil: str, now_s: float) -> PairView | None:
        """Return what a pupil's page shows of the pair."""
        pair = self.of(pupil)
        if pair is None:
            return None
        others = [member for member in self._room.record.pupils if member.id in pair.members and member.id != pupil]
        other = next(iter(others), None)
        return PairView(
            id=pair.id,
            name=pair.name,
            partner=Classmate(other.id, other.name, other.avatar) if other else None,
            joined=pupil in pair.joined,
            partner_joined=other is not None and other.id in pair.joined,
            partner_away=other is not None and other.id in self._away and not self._room.presence[other.id].pages,
            owners=pair.owners,
            versions={window: self.versions.get((pair.id, window), 0) for window in WINDOWS},
            asks=pair.asks,
            conducted=self._conducted_in(pair, now_s),
        )

    def _conducted_in(self, pair: Pair, now_s: float) -> Conducted | None:
        if pair.id not in self._conducted:
            return None
        said_s, conducted = self._conducted[pair.id]
        return structs.replace(conducted, age_ms=int((now_s - said_s) * 1000))

    def to_ask(self, who: str, to: str) -> Pair | None:
        """Return the pair into which a pupil may ask another one; None for a new one. Raises MotorcadeError."""
        asks = self._room.pupil(who)
        asked = self._room.pupil(to)
        pair = self.of(who)
        if pair and len(pair.members) > 1:
            raise MotorcadeError("in-a-pair-already", name=asks.name)
        if self.of(to) or who == to:
            raise MotorcadeError("in-a-pair-already", name=asked.name)
        return pair

    def add(self, name: str) -> Pair:
        """Add a pair in which nobody is yet, so that its files can be stored.

        Args:
            name: of the project.
        """
        record = self._room.record
        record.paired += 1
        record.pairs.append(Pair(str(record.paired), name, [], [], {}))
        self._room.save()
        return record.pairs[-1]

    def begin(self, who: str, to: str, pair: Pair) -> None:
        """Begin a new pair, or ask another one where the partner has left. Raises MotorcadeError.

        Args:
            who: has the leader's window at first, and in a new pair the followers' until the other one has come.
            to: is asked.
            pair: as `to_ask` told, or a new one.
        """
        self.to_ask(who, to)
        if not pair.members:
            pair.members = [who]
            pair.joined = [who]
            pair.owners = dict.fromkeys(WINDOWS, who)
        pair.members.append(to)
        self._room.save()

    def go_on(self, who: str, pair_id: str, new: Pair) -> None:
        """Let a pair have open what was stored for a ``new`` one, which its caller then ends.

        Raises MotorcadeError, as `joined`.
        """
        pair = self.joined(who, pair_id)
        pair.id, new.id = new.id, pair.id
        pair.name = new.name
        record = self._room.record
        record.pairs = [other for other in record.pairs if other.id != new.id]
        record.removed.append(new.library)

    @request("class/pair/take", stores=True)
    def take(self, who: str, window: Window, wants: bool, now_s: float) -> None:
        """Take a window that is free, or whose owner is away; or give it back. Raises MotorcadeError."""
        pair = self.joined(who)
        owner = pair.owners[window]
        if owner not in (None, who) and not self._is_away(owner, now_s):
            raise MotorcadeError("window-of-another", name=self._room.pupil(owner).name)
        if wants:
            pair.owners[window] = who
        else:
            pair.owners[window] = None
        pair.asks = None
        self._room.save()

    def _is_away(self, pupil: str, now_s: float) -> bool:
        presence = self._room.presence.get(pupil)
        return presence is None or (not presence.pages and now_s - presence.left_s >= AWAY_S)

    @request("class/pair/join", stores=True)
    def join(self, who: str) -> None:
        """Come into the pair into which one was asked, and get the followers' window, or one that is free."""
        pair = self.of(who)
        if pair is None:
            raise MotorcadeError("not-in-a-pair")
        if who in pair.joined:
            return
        pair.joined.append(who)
        held = [window for window in WINDOWS if pair.owners[window] is not None]
        pair.owners["leader" if held == ["followers"] else "followers"] = who
        self._room.save()

    @request("class/pair/swap", stores=True)
    def swap(self, who: str, wants: bool) -> None:
        """Ask the other one to swap windows, or agree where the other one has asked; or take that back."""
        pair = self.joined(who)
        if not wants:
            pair.asks = None
        elif len(pair.joined) < len(WINDOWS):
            raise MotorcadeError("not-in-a-pair")
        elif pair.asks in (None, who):
            pair.asks = who
        else:
            pair.owners = {"leader": pair.owners["followers"], "followers": pair.owners["leader"]}
            pair.asks = None
        self._room.save()

    def leave(self, who: str, pair_id: str | None = None) -> None:
        """Leave the pair: windows are free again. The last one who leaves ends it; so does who was never joined."""
        pair = self.of(who)
        if pair and pair_id in (None, pair.id):
            self._room.part(lambda record: leave_pair(record, who))

    @request("class/pair/conduct")
    def conduct(
        self,
        who: str,
        playing: bool,
        speed: Speed,
        seed: Seed,
        t_ms: Milliseconds,
        now_s: float,
    ) -> None:
        """Play the worlds of both pages, or let them stand at a time. Raises MotorcadeError."""
        pair = self.joined(who)
        number = 1
        if pair.id in self._conducted:
            number = self._conducted[pair.id][1].number + 1
        self._conducted[pair.id] = now_s, Conducted(number, who, playing, speed, seed, t_ms)
        self._room.changes += 1

    def advance(self, now_s: float) -> None:
        """Let time pass: who has no page for long is away; what is known of pairs that are over is forgotten."""
        away = set[str]()

        def look(pair: Pair) -> None:
            away.update(member for member in pair.joined if self._is_away(member, now_s))

        try:
            for_all(self._room.record.pairs, look)
        finally:
            self._room.changes += away != self._away
            self._away = away
            lasting = {pair.id for pair in self._room.record.pairs}
            self._conducted = {pair: said for pair, said in self._conducted.items() if pair in lasting}
            self.versions = {key: version for key, version in self.versions.items() if key[0] in lasting}

    def owned(self, who: str, pair_id: str, window: Window) -> Pair:
        """Return a pupil's pair, as `joined`. Raises MotorcadeError where the window isn't the pupil's."""
        pair = self.joined(who, pair_id)
        owner = pair.owners[window]
        if owner is None:
            raise MotorcadeError("window-is-free")
        if owner != who:
            raise MotorcadeError("window-of-another", name=self._room.pupil(owner).name)
        return pair
