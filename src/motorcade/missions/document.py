"""Read missions from TOML and JSON; list those that come with Motorcade, and the shortest programs for them.

`scripts/shortest_programs.py` makes shortest.json.
"""

import json
import tomllib
from collections.abc import Callable
from difflib import get_close_matches
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from motorcade.config.check import Fault, Text, check, first_fault
from motorcade.config.files import KINDS, Kind, parse, raised_as, read_bytes, read_text
from motorcade.config.profile import built_in_profile
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.locales import FIRST, languages
from motorcade.mats.document import check_mat, mat_of
from motorcade.mats.model import Mat
from motorcade.mats.schema import FORMAT as MAT_FORMAT
from motorcade.missions.model import Goal, Mission, Notes, Sentence, Wording, Zone
from motorcade.missions.schema import GOALS, PATHS, goal_schema, mission_schema
from motorcade.program.model import Program, program_from_dict, read_program
from motorcade.program.schema import FORMAT as PROGRAM_FORMAT

# How many seconds of one car all seeds may take together; a computer simulates some 15,000 in a second.
MOST_CAR_SECONDS = 60_000
# The same of a goal that other seeds decide, whose runs are only judged: some 100,000 in a second.
_MOST_JUDGED_CAR_SECONDS = 300_000
# The id of a mission that is no file of the command line's, and has no other id.
OWN = "own"
# Where the missions are that pupils play, and those that experiments with swarms have published.
GALLERY = "gallery"
LITERATURE = "literature"
# The page's editor calls them so.
_ZONE_LABELS = {"name": "zoneName", "corners_m": "corners", "centre_m": "left", "radius_m": "width"}
# Reads a project file that a mission names; raises MotorcadeError or OSError.
Reader = Callable[[str], bytes]


def read_mission(path: Path) -> Mission:
    """Read the mission in the file at ``path``, which ends in .toml or .json.

    Raises MotorcadeError mission-not-valid; its sentence names the place and what to do.
    """
    with raised_as("mission-not-valid", MotorcadeError, InputError):
        kind = KINDS.get(path.suffix.lower())
        with_name = Phrase("mission-named", name=path.name)
        if kind is None:
            raise InputError("mission-file-ending", file=with_name)
        text = read_text(path, with_name)
    return parse_mission(text, path.name.partition(".")[0], kind, lambda name: read_bytes(path.parent / name))


def _called(name: str) -> Phrase:
    if name == OWN:
        return Phrase("this-mission")
    return Phrase("mission-named", name=name)


def parse_mission(text: str, name: str, kind: Kind, reader: Reader | None = None) -> Mission:
    """Read the mission in ``text``. Errors call it ``name``, which is also its id.

    Args:
        reader: reads the project files that the mission names; None where it can name none.

    Raises MotorcadeError mission-not-valid.
    """
    with raised_as("mission-not-valid", MotorcadeError, InputError):
        document = parse(text, kind, _called(name))
    return mission_of(document, name, text if kind == "TOML" else None, reader)


def mission_of(document: Any, name: str, text: str | None = None, reader: Reader | None = None) -> Mission:
    """Convert a parsed document; ``text`` is the TOML that it comes from, for the lines of faults.

    Raises MotorcadeError mission-not-valid.
    """
    with raised_as("mission-not-valid", MotorcadeError, InputError):
        return _Reading(name, text, reader).mission(document)


class _Reading:
    """Converts one document."""

    def __init__(self, name: str, text: str | None, reader: Reader | None) -> None:
        self._name = name
        self._text = text
        self._reader = reader
        self._file = _called(name)
        # The page's editor has no file.
        self._is_draft = name == OWN and text is None

    def mission(self, document: Any) -> Mission:
        checked = self._load(document)
        name = self._wording(checked["name"], ("name",))
        self._check_size(checked)
        mat = mat_of({"format": MAT_FORMAT, "name": name.sentence()} | checked["mat"], self._file)
        profile = built_in_profile(checked["profile"])
        check_mat(mat, profile)
        zones = tuple(self._zone(zone, number) for number, zone in enumerate(checked["zone"]))
        names = [zone.name for zone in zones]
        for number, zone_name in enumerate(names):
            if zone_name in names[:number]:
                raise self._fault("repeated-value", ("zone", number, "name"), value=zone_name)
        goals = tuple(self._goal(goal, number, mat, names) for number, goal in enumerate(checked["goal"]))
        self._check_goals(goals, mat)
        programs = {key: self._program(checked.get(key), key) for key in ("start", "solution", "near_miss")}
        return Mission(
            id=self._name,
            document=checked,
            name=name,
            story=self._wording(checked.get("story", ""), ("story",)),
            learned=self._wording(checked.get("learned", ""), ("learned",)),
            hints=tuple(self._wording(hint, ("hints", number)) for number, hint in enumerate(checked["hints"])),
            mat=mat,
            profile=profile,
            zones=zones,
            goals=goals,
            **programs,
            notes=self._notes(checked.get("notes"), len(checked["hints"])),
        )

    def _load(self, document: Any) -> dict[str, Any]:
        checked, faults = check(document, mission_schema())
        if faults:
            raise self._error(first_fault(faults))
        return checked  # type: ignore[no-any-return]

    def _fault(self, code: str, place: tuple[str | int, ...], value: Text = "", allowed: Text = "") -> MotorcadeError:
        return self._error(Fault(code, place, value, allowed))

    def _error(self, fault: Fault) -> MotorcadeError:
        """The error of a fault; of a draft, in the words of the page's editor."""
        problem = fault.error(self._file, self._text)
        words = _place_in_words(fault.place) if self._is_draft else None
        if words is None:
            return problem
        match fault.place:
            case ("zone", int(number), "name") if str(fault.value).strip('" ') == "":
                return InputError("mission-zone-nameless", number=number + 1)
        return InputError(problem.code, **{**problem.details, "place": words})

    def _wording(self, texts: str | Sentence, place: tuple[str | int, ...]) -> Wording:
        if isinstance(texts, str):
            return Wording(dict.fromkeys(languages(), texts))
        if not texts:
            raise self._fault("no-key", place, allowed=", ".join(languages()))
        first = texts.get(FIRST) or next(iter(texts.values()))
        return Wording({language: texts.get(language, first) for language in languages()})

    def _zone(self, zone: dict[str, Any], number: int) -> Zone:
        title = self._wording(zone.get("title", zone["name"]), ("zone", number, "title"))
        if "corners_m" in zone:
            return Zone(zone["name"], title, tuple((float(x), float(y)) for x, y in zone["corners_m"]))
        x, y = zone["centre_m"]
        return Zone(zone["name"], title, disc=(float(x), float(y), float(zone["radius_m"])))

    def _notes(self, notes: dict[str, Any] | None, hints: int) -> Notes | None:
        if notes is None:
            return None
        texts = {key: self._wording(notes[key], ("notes", key)) for key in ("aim", "say", "further")}
        mistakes = []
        for number, mistake in enumerate(notes["mistakes"]):
            place = ("notes", "mistakes", number)
            if (hint := mistake.get("hint")) is not None and hint > hints:
                allowed = Phrase("whole-range", minimum=1, maximum=hints) if hints else Phrase("nothing")
                raise self._fault("not-allowed", (*place, "hint"), str(hint), allowed)
            mistakes.append((self._wording(mistake["text"], (*place, "text")), hint))
        return Notes(notes["minutes"], mistakes=tuple(mistakes), **texts)

    def _goal(self, goal: dict[str, Any], number: int, mat: Mat, zones: list[str]) -> Goal:
        place = ("goal", number)
        kind = GOALS[goal["kind"]]
        values, faults = check(goal, goal_schema(goal["kind"]))
        if faults:
            first = faults[0]
            raise self._error(first._replace(place=(*place, *first.place)))
        if kind.one_of and not any(key in values for key in kind.one_of):
            raise self._fault("no-key", place, allowed=", ".join(kind.one_of))
        if "zone" in values and values["zone"] not in zones:
            allowed = ", ".join(f'"{zone}"' for zone in zones) or Phrase("nothing")
            raise self._fault("not-allowed", (*place, "zone"), f'"{values["zone"]}"', allowed)
        cars = self._cars(values.get("who"), place, mat)
        text = values.pop("text", None)
        star = values.pop("star")
        del values["kind"]
        words_of = None
        if text is not None:
            words_of = self._wording(text, (*place, "text"))
        return Goal(goal["kind"], star, values, cars, words_of)

    def _cars(self, who: Any, place: tuple[str | int, ...], mat: Mat) -> tuple[int, ...]:
        """The numbers of the cars that ``who`` names."""
        if who is None:
            return ()
        leaders = set(mat.starts.leaders)
        cars = range(len(mat.starts))
        if isinstance(who, list):
            for number in who:
                if number not in cars:
                    allowed = Phrase("whole-range", minimum=0, maximum=len(cars) - 1)
                    raise self._fault("not-allowed", (*place, "who"), str(number), allowed)
            return tuple(who)
        found = tuple(car for car in cars if who == "all" or (car in leaders) == (who == "leader"))
        if not found:
            raise self._fault("mission-without-cars", (*place, "who"), who)
        return found

    def _check_goals(self, goals: tuple[Goal, ...], mat: Mat) -> None:
        if not any(goal.star == 1 for goal in goals):
            raise InputError("mission-without-first-star", file=self._file)
        if not len(mat.starts.leaders):
            raise InputError("mission-without-leader", file=self._file)
        declared = [(goal, GOALS[goal.kind]) for goal in goals]
        for number, (goal, kind) in enumerate(declared):
            fault = kind.fault(goal, declared, mat)
            if fault is not None:
                raise self._fault(fault.code, ("goal", number, *fault.keys), fault.value, fault.allowed)

    def _check_size(self, checked: dict[str, Any]) -> None:
        """Before the cars are placed: a crowd is one line, yet it may have millions of cars."""
        cars = len(checked["mat"]["car"]) + sum(crowd["cars"] for crowd in checked["mat"]["crowd"])
        seconds = checked["seconds"]
        seeds = len(checked["seeds"])
        others = [GOALS[goal["kind"]].other_runs(goal) for goal in checked["goal"]]
        for count, most in ((seeds, MOST_CAR_SECONDS), (max(others), _MOST_JUDGED_CAR_SECONDS)):
            if cars * seconds * count > most:
                size = {"cars": cars, "seconds": seconds, "seeds": count, "most": most}
                raise InputError("mission-too-large", file=self._file, **size)

    def _program(self, document: dict[str, Any] | None, key: str) -> Program | None:
        if document is None:
            return None
        try:
            if "program" not in document:
                return program_from_dict({"format": PROGRAM_FORMAT} | document)
            if self._reader is not None:
                return read_program(self._reader(document["program"]))
            reason: object = InputError("mission-names-no-files")
        except (OSError, MotorcadeError) as problem:
            reason = problem
        raise InputError("mission-program", file=self._file, place=key, reason=reason)


def _place_in_words(place: tuple[str | int, ...]) -> Phrase | None:
    """Return where ``place`` is, for who writes a mission in the page; None where the editor has no such field."""
    match place:
        case ("zone" | "goal" as part, int(number)):
            return Phrase(f"mission-{part}", number=number + 1)
        case ("zone", int(number), str(key), *_) if key in _ZONE_LABELS:
            return Phrase("mission-zone-field", number=number + 1, label=_label(_ZONE_LABELS[key]))
        case ("goal", int(number), str(key), *_) if key in ("kind", "star"):
            return Phrase("mission-goal-field", number=number + 1, label=_label(key))
        case ("goal", int(number), str(key), *_) if _label("fields", key).sentence():
            return Phrase("mission-goal-field", number=number + 1, label=_label("fields", key))
        case ("name" | "story" | "seconds" as key, *_):
            return Phrase("mission-field", label=_label(key))
    return None


def _label(*path: str) -> Wording:
    """The name of a field of the editor, as the page shows it."""
    return Wording.of_page("missions", *path)


@cache
def missions(folder: str = GALLERY) -> tuple[Mission, ...]:
    """The missions that come with Motorcade in GALLERY or LITERATURE, path by path and in order."""
    found = [built_in_mission(name) for name in _names(folder)]
    return tuple(sorted(found, key=lambda mission: (PATHS.index(mission.document["path"]), mission.document["order"])))


@cache
def built_in_mission(name: str) -> Mission:
    """The mission with an id. Raises MotorcadeError no-mission, with a similar id or all of them."""
    for folder in (GALLERY, LITERATURE):
        if name in _names(folder):
            text = (resources.files("motorcade.missions") / folder / f"{name}.toml").read_text(encoding="utf-8")
            return mission_of(tomllib.loads(text), name)
    known = [*_names(GALLERY), *_names(LITERATURE)]
    near = get_close_matches(name[:40], known, 1)
    hint = Phrase("did-you-mean", name=near[0]) if near else Phrase("missions-are", known=", ".join(known))
    raise InputError("no-mission", name=name[:40], hint=hint)


def _names(folder: str) -> list[str]:
    files = (resources.files("motorcade.missions") / folder).iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


@cache
def shortest_programs() -> dict[str, dict[str, Any]]:
    """Of each mission by id the shortest ``program`` found for all stars, its ``blocks``, and the search's ``runs``."""
    text = (resources.files("motorcade.missions") / "shortest.json").read_text(encoding="utf-8")
    found: dict[str, dict[str, Any]] = json.loads(text)
    return found
