"""A class by HTTPS beside a lesson: its keys, its certificate for tablets, and cookies that no other way carries."""

import asyncio
import os
import ssl
import sys
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from cryptography import x509
from tests.faults import lesson_heads
from tests.faults.browsers import DONE, Browser
from tests.faults.class_room import FILES, STORED, page_folder
from tests.faults.lesson_doors import AVATAR
from tests.faults.loop import SimulatedLoop
from tests.faults.pupils import PASSWORD
from tests.faults.system import replaced
from tests.faults.world import Process

from motorcade.classroom.app import make_class_app
from motorcade.classroom.folder import RECORD, ClassFolder
from motorcade.classroom.network import LOCAL_NAME, Network, class_keys, qr_svg
from motorcade.classroom.record import new_record, to_bytes
from motorcade.classroom.running import ClassServerSettings
from motorcade.config import files
from motorcade.drive.keys import https_context
from motorcade.server.running import serving

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson

_HOST, _PORT = "secure", 7711
_HOSTS = ("192.168.1.5", "fd00::5")
_STARTS_S = 0.5
_NOW = datetime(2026, 12, 1, tzinfo=UTC)


def _keys(folder: Path, hosts: Sequence[str], days: float = 0) -> tuple[bytes, bytes, Path]:
    """The keys and the authority's certificate that a class gets so many days later, and where its keys are."""
    # They take no part in what happens, and are files of this computer.
    with replaced({(files, "os"): os, (files, "sys"): sys}):
        own, authority = class_keys(folder, hosts, _NOW + timedelta(days=days))
    return own.read_bytes(), authority.read_bytes(), own


@cache
def _held() -> tuple[Any, ...]:
    """The folder of a class's keys, with the contexts of its server and of a tablet that trusts it."""
    folder = TemporaryDirectory(prefix="motorcade-")
    place = Path(folder.name) / "https"
    made, authority, own = _keys(place, _HOSTS)
    return folder, place, made, authority, https_context(own), ssl.create_default_context(cadata=authority.decode())


def contexts() -> tuple[ssl.SSLContext, ssl.SSLContext]:
    """TLS of a server with a class's keys, and of a browser that trusts them."""
    *_, own, trusts = _held()
    return own, trusts


async def keep_keys(run: "Lesson") -> None:
    """A class's keys are for its addresses and stay as long as these do; a tablet that trusts them goes on to do so."""
    _, folder, made, authority, *_ = _held()
    kind = run.random.choice(("again", "another order", "other addresses", "soon over", "damaged"))
    found, found_authority, own = made, authority, folder
    try:
        if kind == "damaged":
            _, _, own = _keys(folder, _HOSTS)
            own.write_bytes(b"damaged")
        hosts = {"another order": _HOSTS[::-1], "other addresses": ("10.0.0.9",)}.get(kind, _HOSTS)
        found, found_authority, own = _keys(folder, hosts, 390.0 if kind == "soon over" else 380.0)
        is_same = kind in ("again", "another order")
        run.world.keep("answered-stays", (found == made) == is_same, "{}: the class's keys", kind)
        run.world.keep("answered-stays", found_authority == authority, "{}: the authority is another one", kind)
        names = x509.load_pem_x509_certificate(found).extensions.get_extension_for_class(x509.SubjectAlternativeName)
        told = {str(name.value) for name in names.value}
        known = {LOCAL_NAME, *hosts}
        run.world.keep("as-asked", known <= told, "{}: the keys are for {}, not {}", kind, told, known)
    finally:
        for file in folder.glob("class-*.pem"):
            file.unlink()
        _first_file(folder).write_bytes(made)


@cache
def _first_file(folder: Path) -> Path:
    return _keys(folder, _HOSTS)[2]


async def class_by_https(run: "Lesson") -> None:
    """Somebody joins, the teacher signs in, and both leave: cookies and addresses are those of HTTPS."""
    _, folder, _, authority, tls, trusts = _held()
    process = Process(run.world, _HOST, 0.001)
    loop = SimulatedLoop(process, run.network)
    run.network.link(_HOST, 0.001)
    place: Any = run.disk.path(f"/secure-{run.studios}")
    run.disk.create(place, True)
    record = new_record(run.random.randrange)
    record.password = STORED
    run.disk.create(place / RECORD, False).data = to_bytes(record)
    network = Network(_HOSTS, _PORT, "https")

    async def serve() -> None:
        settings = ClassServerSettings(
            library=place,
            page=page_folder(),
            port=_PORT,
            names=frozenset((LOCAL_NAME,)),
            network=network,
            authority=folder / "authority.crt",
            clock=loop.time,
        )
        listener: Any = run.network.listen(process, _HOST, _PORT)
        async with serving(make_class_app(settings, ClassFolder(place)), settings, listener, tls):
            await asyncio.Event().wait()

    loop.run(serve)
    await asyncio.sleep(_STARTS_S)
    run.studios += 1

    def browser(number: int) -> Browser:
        address = f"10.7.{run.studios}.{number}"
        return Browser(address=address, host=f"{LOCAL_NAME}:{_PORT}", server=(_HOST, _PORT), tls=trusts)

    pupil, teacher = browser(1), browser(2)
    joined = {"code": record.code, "name": "Mia", "avatar": AVATAR}
    for one, request, message, path, leaves in (
        (pupil, "class/join", joined, "class/stream", "class/leave"),
        (teacher, "teacher/sign-in", {"password": PASSWORD}, "teacher/stream", "teacher/sign-out"),
    ):
        outcome, _ = await one.ask(request, **message)
        run.world.keep("right-guess", outcome == DONE, f"{request} by HTTPS ends in {outcome}")
        run.world.keep("no-secrets", len(one.given) == 1, f"{request} gives {one.given}")
        lesson_heads.check_cookie(run, one.given[0], is_secure=True)
        page = (await one.open(path, headers=f"Origin: https://{LOCAL_NAME}:{_PORT}\r\n")).follow()
        await asyncio.sleep(0.2)
        run.world.keep("page-stays", bool(page.messages) and not page.has_ended, f"{path} by HTTPS: {page.refused}")
        page.close()
        if one is teacher:
            await _check_addresses(run, teacher, record.code)
        outcome, _ = await one.ask(leaves)
        run.world.keep("leaves", (outcome, one.cookies) == (DONE, {}), f"{leaves} by HTTPS ends in {outcome}")
    outcome, data = await browser(3).fetch("GET", "/authority.crt")
    run.world.keep("as-asked", data == authority, f"the certificate for tablets: {outcome} {data[:40]!r}")
    outcome, data = await browser(4).fetch("GET", "/join")
    run.world.keep("as-asked", data.decode() == FILES["class.html"], f"the page by HTTPS: {outcome}")
    process.end()


async def _check_addresses(run: "Lesson", teacher: Browser, code: str) -> None:
    addresses = [f"https://{_HOSTS[0]}:{_PORT}/", f"https://[{_HOSTS[1]}]:{_PORT}/"]
    known = {"code": code, "addresses": addresses, "local_name": None, "why_no_name": None}
    known["qr_code"] = qr_svg(f"{addresses[0]}join#{code}")
    _, shown = await teacher.ask("teacher/addresses")
    run.world.keep("as-asked", shown == known, f"{shown} in place of {known}")


ACTS = [(0.35, class_by_https), (0.15, keep_keys)]
