"""The page itself, as it was built; where it wasn't, how to build it."""

from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from motorcade.studio.settings import Settings

_NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Motorcade</title>
<h1>The studio runs, but its page isn't built</h1>
<p>In the folder <code>web</code> run <code>npm ci</code> and <code>npm run build</code>, start the studio again, and
reload.</p>
<h1 lang="zh">工作室已启动，但页面尚未构建</h1>
<p lang="zh">请在 <code>web</code> 文件夹中运行 <code>npm ci</code> 和
<code>npm run build</code>，重新启动工作室，然后刷新。</p>
</html>
"""


def routes(settings: Settings) -> list[BaseRoute]:
    """The page and all that it loads."""
    if not (settings.page / "index.html").is_file():
        return [Route("/", _not_built)]
    files = StaticFiles(directory=settings.page, html=True)
    return [Mount("/", GZipMiddleware(files, minimum_size=1024, compresslevel=6))]


def _not_built(request: Request) -> HTMLResponse:
    return HTMLResponse(_NOT_BUILT, 503)
