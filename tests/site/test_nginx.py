"""nginx hands out the site as docs/hosting.md configures it."""

import gzip
import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
from scripts import debian

from motorcade.browser.site import write_site
from support.doc_pages import ROOT, blocks_of

TYPES = {
    "index.html": "text/html",
    "sw.js": "javascript",
    "assets/a.mjs": "text/javascript",
    "assets/a.wasm": "application/wasm",
    "assets/a.css": "text/css",
    "python-0123456789ab/a.json": "application/json",
    "icon.svg": "image/svg+xml",
    "manifest.webmanifest": "application/manifest+json",
}
CONTENT = b"x" * 5000


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A site below a path, served by nginx with the documented block; its certificate is left out."""
    folder = tmp_path_factory.mktemp("nginx")
    found = shutil.which("nginx")
    if found is None and not debian.unpack(folder, "nginx", "nginx-common"):
        pytest.skip("no nginx (on Debian: apt-get install nginx)")
    root = Path("/") if found else folder
    nginx = found or folder / "usr" / "sbin" / "nginx"
    write_site(folder / "www" / "school" / "motorcade", dict.fromkeys(TYPES, CONTENT))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (block,) = (each.text for each in blocks_of(ROOT / "docs" / "hosting.md") if each.text.startswith("server {"))
    lines = [line for line in block.splitlines() if "ssl_" not in line]
    server = "\n".join(lines).replace("443 ssl", f"127.0.0.1:{port}").replace("/srv/www", str(folder / "www"))
    paths = "".join(
        f"{each}_temp_path {folder}/{each};" for each in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(
        f"{user} pid {folder}/pid; error_log {folder}/errors; events {{}}\n"
        f"http {{ default_type application/octet-stream; access_log off; {paths}\n"
        f"{server.replace('include mime.types', f'include {root}/etc/nginx/mime.types')} }}"
    )
    command = [nginx, "-c", folder / "nginx.conf", "-p", folder]
    # It listens when the first process ends.
    subprocess.run(command, check=True)
    yield f"http://127.0.0.1:{port}/school/motorcade/"
    subprocess.run([*command, "-s", "stop"], check=True)


@pytest.mark.parametrize("name", ["", *TYPES])
def test_each_kind_of_file_has_its_type_is_compressed_and_kept_as_long_as_it_may(address, name):
    with urlopen(Request(address + name, headers={"Accept-Encoding": "gzip"})) as answer:
        assert gzip.decompress(answer.read()) == CONTENT
    assert TYPES[name or "index.html"] in answer.headers["Content-Type"]
    kept = "max-age=31536000" if name.startswith(("assets/", "python-")) else "no-cache"
    assert answer.headers["Cache-Control"] == kept
