"""What pages show of a class, whole, at a time."""

from motorcade.classroom.messages import ClassView, MatView, PairView, PupilRow, PupilView
from motorcade.classroom.record import Presence, Pupil
from motorcade.classroom.room import Classroom
from motorcade.service.messages import Sentence


def pupil_view(room: Classroom, pupil: Pupil, mat: MatView, pair: PairView | None = None) -> PupilView:
    """Return what a pupil's page shows of the class; no other pupil's number or progress."""
    return PupilView(
        me=room.self_of(pupil),
        hand=room.presence[pupil.id].hand_s is not None,
        frozen=room.frozen,
        shared=room.shared(),
        stopped=room.stopped,
        mat=mat,
        mission=pupil.mission,
        news=pupil.news,
        pair=pair,
    )


def class_view(room: Classroom, mat: MatView, now_s: float, disk: Sentence | None = None) -> ClassView:
    """Return what the teacher's page shows; ``disk`` is why work can't be stored at present."""
    record = room.record
    return ClassView(
        title=record.title,
        code=record.code,
        is_open=record.is_open,
        frozen=room.frozen,
        stuck_minutes=record.stuck_minutes,
        pupils=[_row(each, room.presence[each.id], now_s) for each in record.pupils],
        shared=room.shared(),
        stopped=room.stopped,
        mat=mat,
        disk=disk,
    )


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
    )
