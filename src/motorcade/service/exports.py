"""What can be downloaded of a run: its events as CSV, and films of what is kept of it."""

import asyncio
import csv
import io
import multiprocessing
import tempfile
from collections.abc import Awaitable, Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.errors import MotorcadeError
from motorcade.runs.recording import InMemoryRecording
from motorcade.service.errors import StudioError
from motorcade.service.playback import Playback

COLUMNS = ("t_ms", "car", "event", "why", "word", "other")
_FILMS = {"run.gif": "image/gif", "run.mp4": "video/mp4"}
_SECONDS, _MOST_SECONDS = 10.0, 60.0

# Does a job with the stage while nobody else has it.
Work = Callable[[Callable[[Playback], object]], Awaitable[object]]


class Exports:
    """The downloads of a server, of which one film is drawn at a time."""

    def __init__(self) -> None:
        self._drawing = asyncio.Semaphore(1)

    async def answer(self, request: Request, work: Work) -> Response:
        """The file that the request names, from the stage that ``work`` reaches. Raises StudioError."""
        file = request.path_params["file"]
        headers = {"Content-Disposition": f'attachment; filename="{file}"'}
        if file == "timeline.csv":
            batches: list[NDArray[np.void]] = []
            await work(lambda stage: batches.extend(stage.events()))
            return StreamingResponse(timeline(batches), media_type="text/csv; charset=utf-8", headers=headers)
        if file not in _FILMS:
            raise StudioError("no-world", 404)
        seconds = _seconds(request.query_params.get("seconds", ""))
        kept: list[InMemoryRecording] = []
        await work(lambda stage: kept.append(recording(stage, seconds)))
        film = await self._film(kept[0], file)
        return Response(film, media_type=_FILMS[file], headers=headers)

    async def _film(self, run: InMemoryRecording, file: str) -> bytes:
        if run.last_ms == 0:
            raise StudioError("nothing-to-draw", 409)
        loop = asyncio.get_running_loop()
        async with self._drawing:
            # Drawing is Python's own work, which in this process would hold up everybody's cars.
            elsewhere = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
            try:
                return await loop.run_in_executor(elsewhere, film_of, run, file)
            except (MotorcadeError, BrokenProcessPool) as problem:
                raise StudioError("film-failed", 500, reason=str(problem).rstrip(".")) from None
            finally:
                elsewhere.shutdown(wait=False)


def timeline(batches: list[NDArray[np.void]]) -> Iterator[str]:
    """Rows of EVENT_ROW as CSV, with a head, a batch at a time."""
    yield _lines([COLUMNS])
    for batch in batches:
        yield _lines(
            (t_ms, car, KINDS[kind], LOSS_REASONS[why], f"0x{word:08X}", other)
            for t_ms, car, kind, why, _, word, other in batch.tolist()
        )


def _lines(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue()


def recording(stage: Playback, seconds: float) -> InMemoryRecording:
    """The last simulated seconds of a run."""
    kept = InMemoryRecording(stage.about())
    for frame in stage.frames(seconds):
        kept.write(frame)
    return kept


def film_of(run: InMemoryRecording, file: str) -> bytes:
    """The bytes of a film. Raises MotorcadeError."""
    # The server does without Matplotlib, which takes longer to load than all the rest of it.
    from motorcade.runs.video import draw_film

    with tempfile.TemporaryDirectory(prefix="motorcade-", ignore_cleanup_errors=True) as folder:
        draw_film(run, Path(folder) / file)
        return (Path(folder) / file).read_bytes()


def _seconds(text: str) -> float:
    try:
        seconds = float(text or _SECONDS)
    except ValueError:
        seconds = 0.0
    if not 0 < seconds <= _MOST_SECONDS:
        raise StudioError("bad-message", reason=f"seconds is {text[:20]!r}; allowed: above 0, up to {_MOST_SECONDS:g}")
    return seconds
