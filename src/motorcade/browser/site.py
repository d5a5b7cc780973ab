"""The studio as a folder of static files, which any web server can hold: Python runs in the browser.

python.zip is the part of the package motorcade that runs there, and nothing else of it.
"""

import hashlib
import io
import json
import zipfile
from base64 import b64encode
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from motorcade.browser.shell import CAPABILITIES
from motorcade.config.files import raised_as, read_bytes, replace_file
from motorcade.errors import MotorcadeError, Phrase
from motorcade.imports import PACKAGE, needed_files
from motorcade.locales import FIRST, languages
from motorcade.service import documents, programs

# What the worker imports; all else is found by its imports.
SHELL = ("browser/preload.py", "browser/shell.py")
# The web app manifest without its texts.
_MANIFEST = "manifest.json"
# What a first visit finds, and its first seconds; `scripts/opening_recording.py` writes it.
OPENING = PACKAGE / "browser" / "opening.json"
# engine.wasm is a file of its own, so that the browser compiles it while it arrives.
_LEFT_OUT = ("py.typed", "engine.wasm", _MANIFEST, OPENING.name)
_PACKED_AT = (1980, 1, 1, 0, 0, 0)
# The build of the page writes them here.
PAGE = PACKAGE / "server" / "page"
# The list of a site's files, by which `motorcade site` knows a folder that it may write again.
LIST = "site.json"
_FORMAT = "motorcade-site/1"
_ENTRY = "site.html"
_INDEX = "index.html"
_WORKER = "sw.js"
# What the build puts in the place of the list of files in sw.js.
_FILES_MARK = b"self.__WB_MANIFEST"
# Answers that the page has before Python runs.
_FIRST_ANSWERS = {
    "capabilities": lambda: CAPABILITIES,
    "profiles": programs.profile_figures,
    "examples": documents.examples,
}
# Blockly and the page style and draw by data: and blob: addresses. Workers, and scripts, come from files alone.
POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "font-src 'self' data:; manifest-src 'self'; base-uri 'none'; form-action 'none'"
)


def zip_of(files: dict[str, bytes]) -> bytes:
    """Return a ZIP archive of files by name. The same files give the same bytes, on every system."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name, _PACKED_AT)
            info.external_attr = 0o644 << 16
            info.create_system = 3
            archive.writestr(info, data, zipfile.ZIP_DEFLATED, 9)
    return packed.getvalue()


def python_zip(package: Path = PACKAGE) -> bytes:
    """Return python.zip. The same files give the same bytes.

    Args:
        package: the folder of the package motorcade.
    """
    modules = reached_modules(package)
    files = sorted({*modules, *_data_files(modules)})
    return zip_of({f"motorcade/{file.relative_to(package).as_posix()}": file.read_bytes() for file in files})


def reached_modules(package: Path = PACKAGE) -> set[Path]:
    """Return the files of the modules that the shell in the browser reaches by imports, its own files included."""
    return needed_files((package / name for name in SHELL), package)


def _data_files(modules: Iterable[Path]) -> Iterator[Path]:
    """Yield the data of the packages of these modules: files beside them, and folders without modules."""
    for folder in {module.parent for module in modules}:
        for path in folder.iterdir():
            # Python's caches of this computer, and machine code, which no browser runs.
            if path.name in ("__pycache__", "libraries"):
                continue
            files = [path]
            if path.is_dir():
                files = [file for file in path.rglob("*") if file.is_file()]
                if any(file.suffix == ".py" for file in files):
                    continue
            yield from (file for file in files if file.name not in _LEFT_OUT and file.suffix not in (".py", ".pyc"))


def site_files(page: Path = PAGE) -> dict[str, bytes]:
    """Return the files of the site: each path and its bytes; the same installation gives the same bytes.

    Args:
        page: the folder of the built page.

    Raises:
        MotorcadeError: the page isn't built.
    """
    if not (page / _ENTRY).is_file():
        raise MotorcadeError("page-missing", folder=page)
    # Each page but the site's own is for a server.
    built = (path for path in page.rglob("*") if path.is_file() and path.suffix != ".html")
    files = {path.relative_to(page).as_posix(): path.read_bytes() for path in built}
    worker = files.pop(_WORKER)
    python = {"python.zip": python_zip(), "engine.wasm": (PACKAGE / "engine" / "engine.wasm").read_bytes()}
    for name, answer in _FIRST_ANSWERS.items():
        python[f"start/{name}.json"] = msgspec.json.encode(answer())
    python["start/opening.zip"] = zip_of({OPENING.name: OPENING.read_bytes()})
    # The folder's name changes with its content, so that no page ever has Python of another build.
    folder = f"python-{hashlib.sha256(_list_of(python)).hexdigest()[:12]}/"
    files.update({folder + name: data for name, data in python.items()})
    files["manifest.webmanifest"] = _manifest()
    files[_INDEX] = _index((page / _ENTRY).read_text(encoding="utf-8"), folder)
    entries = [_entry(name, data) for name, data in sorted(files.items())]
    assert _FILES_MARK in worker, f"{_WORKER} has no place for the list of files"
    files[_WORKER] = worker.replace(_FILES_MARK, json.dumps(entries).encode())
    return dict(sorted(files.items()))


def _entry(name: str, data: bytes) -> dict[str, Any]:
    """Return a file's line in the service worker's list; no revision where its name changes with it."""
    digest = hashlib.sha256(data)
    has_hash = name.startswith(("python-", "assets/")) and not name.startswith("assets/blockly/")
    if has_hash:
        revision = None
    else:
        revision = digest.hexdigest()[:16]
    return {"url": name, "revision": revision, "integrity": "sha256-" + b64encode(digest.digest()).decode()}


def write_site(folder: Path, files: dict[str, bytes]) -> None:
    """Write a site into ``folder``: a new or empty one, or one that holds a site, which is replaced.

    index.html is removed first and written last, so that what an interrupted call leaves is no site; the next call
    takes it up.

    Raises:
        MotorcadeError: the folder can't be written, or holds other files.
    """
    with raised_as("folder-not-writable", OSError, folder=folder):
        folder.mkdir(parents=True, exist_ok=True)
    present = {
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_symlink() or not path.is_dir()
    }
    if others := sorted(present - _listed(folder)):
        raise MotorcadeError("site-folder-in-use", folder=folder, file=others[0])
    place = folder
    try:
        for place in (folder / _INDEX, *(folder / name for name in present - {LIST})):
            place.unlink(missing_ok=True)
            for parent in place.relative_to(folder).parents[:-1]:
                with suppress(OSError):
                    (folder / parent).rmdir()
        # By the list, which is the first, the next call knows the files of an interrupted one.
        place = folder / LIST
        replace_file(place, _list_of(files))
        for name in sorted(files, key=lambda address: (address == _INDEX, address)):
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(files[name])
    except OSError as problem:
        raise MotorcadeError("file-not-writable", file=place, reason=problem) from None


def _listed(folder: Path) -> set[str]:
    """Return the names in a folder's list of files; none where it has no such list."""
    try:
        listed = json.loads(read_bytes(folder / LIST))
    except (OSError, ValueError):
        return set()
    if not isinstance(listed, dict) or listed.get("format") != _FORMAT or not isinstance(listed.get("files"), dict):
        return set()
    return {LIST, *listed["files"]}


def _list_of(files: dict[str, bytes]) -> bytes:
    """Return the list of files with their hashes, as JSON."""
    hashes = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(files.items())}
    return json.dumps({"format": _FORMAT, "files": hashes}, indent=1).encode() + b"\n"


def _index(page: str, folder: str) -> bytes:
    """Return index.html: the built page with the policy for its content and the address of Python's files."""
    tags = (
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}" />\n    '
        f'<meta name="motorcade-python" content="{folder}" />\n    '
        '<link rel="manifest" href="manifest.webmanifest" />\n    '
    )
    return page.replace('<meta charset="utf-8" />\n    ', f'<meta charset="utf-8" />\n    {tags}', 1).encode()


def _manifest() -> bytes:
    """Return the web app manifest, in English with the other languages beside it."""
    document: dict[str, Any] = json.loads((PACKAGE / "browser" / _MANIFEST).read_bytes())
    others = [language for language in languages() if language != FIRST]
    for part in ("name", "short_name", "description"):
        phrase = Phrase(f"site-{part.replace('_', '-')}")
        document[part] = phrase.sentence(FIRST)
        document[f"{part}_localized"] = {language: phrase.sentence(language) for language in others}
    return json.dumps(document, ensure_ascii=False, indent=1).encode() + b"\n"
