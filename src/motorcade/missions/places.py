"""Where a fault of a mission is, in the words of the page's editor: ``zone[0].name`` is 'Zone' of zone 1."""

from motorcade.config.check import Place
from motorcade.errors import Phrase
from motorcade.locales import page_text

_ZONE_LABELS = {"name": "zoneName", "corners_m": "corners", "centre_m": "left", "radius_m": "width"}


class _Label:
    """The name of a field of the editor, as the page shows it."""

    def __init__(self, *path: str) -> None:
        self._path = ("missions", *path)

    def sentence(self, language: str = "en") -> str:
        """The name in ``language``."""
        return page_text(self._path, language)


def place_in_words(place: Place) -> Phrase | None:
    """Return where ``place`` is, for who writes a mission in the page; None where the editor has no such field."""
    match place:
        case ("zone" | "goal" as part, int(number)):
            return Phrase(f"mission-{part}", number=number + 1)
        case ("zone", int(number), str(key), *_) if key in _ZONE_LABELS:
            return Phrase("mission-zone-field", number=number + 1, label=_Label(_ZONE_LABELS[key]))
        case ("goal", int(number), str(key), *_) if key in ("kind", "star"):
            return Phrase("mission-goal-field", number=number + 1, label=_Label(key))
        case ("goal", int(number), str(key), *_) if page_text(("missions", "fields", key), "en"):
            return Phrase("mission-goal-field", number=number + 1, label=_Label("fields", key))
        case ("name" | "story" | "seconds" as key, *_):
            return Phrase("mission-field", label=_Label(key))
    return None
