"""An uploader that soon gives up, for cars that never answer."""

from motorcade.upload import transfer
from motorcade.words import upload, uploader


def give_up_after(monkeypatch, ms):
    """Let uploads and readbacks wait no longer than this for each answer, whichever module holds the limit."""
    monkeypatch.setattr(upload, "ANSWER_WITHIN_MS", ms)
    monkeypatch.setattr(uploader, "ANSWER_WITHIN_MS", ms)
    monkeypatch.setattr(transfer, "CHECKED_WITHIN_MS", ms)
