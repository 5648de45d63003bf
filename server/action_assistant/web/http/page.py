"""The built page, served from memory: a few megabytes, read again when somebody builds it anew."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from litestar.enums import ScopeType
from litestar.types import ASGIApp, HTTPScope, Receive, Scope, Send

from action_assistant.web.http.static_files import File, send_file

_NOT_PAGES: Final = ("/api/", "/runner/", "/schema", "/healthz", "/readyz", "/metrics")
_UNBUILT: Final = b"""<!doctype html><meta charset="utf-8"><title>Page not built</title>
<p>The page has not been built. Run <code>make setup</code> in the folder of the source code.</p>
"""


class Page:
    """An ASGI middleware that answers for the page's own paths and passes other requests on.

    `root_of(scope)` is the path prefix of the page for this client: "" or for example "/temoto".
    """

    def __init__(
        self, app: ASGIApp, folder: Path, root_of: Callable[[HTTPScope], str] = lambda _: ""
    ) -> None:
        self._app = app
        self._folder = folder
        self._root_of = root_of
        self._built: float | None = None
        self._files: dict[str, File] = {}
        self._index = File(_UNBUILT, ".html", lasting=False)
        self._rooted: dict[str, File] = {}
        self._renew()

    def _renew(self) -> None:
        """Read the files if the page was built since; a build writes its index last."""
        try:
            built = (self._folder / "index.html").stat().st_mtime
        except OSError:
            return
        if built != self._built:
            files = _load(self._folder)
            self._files, self._index, self._built = files, files["/index.html"], built
            self._rooted = {}

    def _index_at(self, root: str) -> File:
        """Return the index page, with its relative links changed to links below `root`."""
        if root not in self._rooted:
            body = self._index.body.replace(b'="./', f'="{root}/'.encode())
            self._rooted[root] = File(body, ".html", lasting=False)
        return self._rooted[root]

    def knows(self, path: str, accepts_html: bool) -> bool:
        """Return whether a path is public: a file of the page or one of its addresses."""
        if path in self._files or path == "/":
            return True
        return accepts_html and not path.startswith(_NOT_PAGES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, or the page itself for an address that the page's router knows."""
        if scope["type"] != ScopeType.HTTP or scope["method"] not in {"GET", "HEAD"}:
            await self._app(scope, receive, send)
            return
        accepts = dict(scope["headers"]).get(b"accept", b"")
        if not self.knows(scope["path"], b"text/html" in accepts):
            await self._app(scope, receive, send)
            return
        found = self._files.get(scope["path"])
        if found is None or found is self._index:
            self._renew()
            found = self._index_at(self._root_of(scope))
        await send_file(scope, send, found)


def _load(folder: Path) -> dict[str, File]:
    return {
        f"/{path.relative_to(folder).as_posix()}": File(
            path.read_bytes(), path.suffix, lasting="assets" in path.parts
        )
        for path in folder.rglob("*")
        if path.is_file() and not path.relative_to(folder).parts[0].startswith(".")
    }
