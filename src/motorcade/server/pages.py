"""The pages themselves, as they were built; where they weren't, how to build them."""

from pathlib import Path

from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

# Where the build puts them.
PAGE = Path(__file__).with_name("page")
_REMOTE = "/drive"
_NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Motorcade</title>
<h1>The server runs, but its page isn't built</h1>
<p>In the folder <code>web</code> run <code>npm ci</code> and <code>npm run build</code>, start the server again, and
reload.</p>
<h1 lang="zh">服务器已启动，但页面尚未构建</h1>
<p lang="zh">请在 <code>web</code> 文件夹中运行 <code>npm ci</code> 和
<code>npm run build</code>，重新启动服务器，然后刷新。</p>
</html>
"""


def page_routes(folder: Path = PAGE) -> list[BaseRoute]:
    """The studio's page and the remote's, and all that they load; what stands at these addresses before them wins."""
    if not (folder / "index.html").is_file():
        return [Route(path, _not_built) for path in ("/", _REMOTE)]
    files = StaticFiles(directory=folder, html=True)

    def remote(request: Request) -> Response:
        page = folder / "drive.html"
        return FileResponse(page) if page.is_file() else _not_built(request)

    return [Route(_REMOTE, remote), Mount("/", GZipMiddleware(files, minimum_size=1024, compresslevel=6))]


def _not_built(request: Request) -> HTMLResponse:
    return HTMLResponse(_NOT_BUILT, 503)
