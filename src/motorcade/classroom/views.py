"""What pages show of a class, whole, at a time."""

from motorcade.classroom.classroom import Classroom
from motorcade.classroom.desk_messages import ClassView, PupilRow
from motorcade.classroom.messages import CableUse, CarTurn, Classmate, MatView, PupilView
from motorcade.classroom.presence import Presence
from motorcade.classroom.record import Pupil
from motorcade.service.messages import Sentence


def pupil_view(room: Classroom, pupil: Pupil, mat: MatView, now_s: float) -> PupilView:
    """What a pupil's page shows of the class; no other pupil's number or progress."""
    queue = room.cable.pupils
    return PupilView(
        me=room.self_of(pupil),
        hand=room.presence[pupil.id].hand_s is not None,
        frozen=room.frozen,
        cable=queue.index(pupil.id) if pupil.id in queue else None,
        cable_use=_cable_use(room),
        turns=_turns(room, now_s),
        stopped=room.stopped,
        mat=mat,
        mission=pupil.mission,
        news=pupil.news,
    )


def class_view(room: Classroom, mat: MatView, now_s: float, disk: Sentence | None = None) -> ClassView:
    """What the teacher's desk shows; ``disk`` is why work can't be stored at present."""
    record = room.record
    return ClassView(
        title=record.title,
        code=record.code,
        is_open=record.is_open,
        frozen=room.frozen,
        stuck_minutes=record.stuck_minutes,
        turn_s=record.turn_s,
        pupils=[_row(each, room.presence[each.id], now_s) for each in record.pupils],
        cable=list(room.cable.pupils),
        cable_use=_cable_use(room),
        turns=_turns(room, now_s),
        stopped=room.stopped,
        mat=mat,
        disk=disk,
    )


def classmates(room: Classroom, pupil: Pupil) -> list[Classmate]:
    """The other pupils."""
    return [Classmate(each.id, each.name, each.avatar) for each in room.record.pupils if each is not pupil]


def _row(pupil: Pupil, presence: Presence, now_s: float) -> PupilRow:
    return PupilRow(
        id=pupil.id,
        name=pupil.name,
        avatar=pupil.avatar,
        number=pupil.number,
        online=presence.pages > 0,
        away_s=0 if presence.pages else int(now_s - presence.left_s),
        hand_s=None if presence.hand_s is None else int(now_s - presence.hand_s),
        stuck_s=int(now_s - presence.step_s) if presence.stuck else None,
        mission=presence.mission,
        goals_met=presence.met,
        goals=presence.goals,
        stars=presence.stars,
        wrong_numbers=presence.wrong_numbers,
    )


def _cable_use(room: Classroom) -> CableUse:
    if room.cable.is_ending:
        return "ending"
    return "sends" if room.cable.is_sending else "free"


def _turns(room: Classroom, now_s: float) -> list[CarTurn]:
    turn_s = room.record.turn_s
    return [
        CarTurn(car, turns.first, int(turns.left_s(now_s, turn_s)), turns.pupils[1:])
        for car, turns in room.turns.items()
    ]
