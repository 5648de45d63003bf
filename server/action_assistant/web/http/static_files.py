"""Serves the built page and the built documentation: typed, compressed where that pays, with a tag.

Both are read from memory, and again when somebody builds them anew. They say nothing of this server.
"""

import asyncio
import gzip
import hashlib
import mimetypes
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, Final

from anyio import to_thread
from litestar.enums import ScopeType
from litestar.types import ASGIApp, HTTPScope, Receive, Scope, Send

_COMPRESSED: Final = frozenset({".html", ".js", ".css", ".svg", ".json", ".webmanifest"})
_TEXTS: Final = frozenset({".html", ".js", ".css"})
_WORTH: Final = 1000  # bytes
_MEDIA: Final = {**mimetypes.types_map, ".webmanifest": "application/manifest+json"}

_REFUSED: Final = re.compile(rb"q=0(\.0*)?")
#: The suffix of copies that the build of the page has compressed.
_BROTLI: Final = ".br"

Fields = tuple[tuple[bytes, bytes], ...]


_NOT_PAGES: Final = ("/api/", "/runner/", "/schema", "/healthz", "/readyz", "/metrics")
_UNBUILT: Final = b"""<!doctype html><meta charset="utf-8"><title>Page not built</title>
<p>The page has not been built. Run <code>make setup</code> in the folder of the source code.</p>
"""
_HELP: Final = "/help"
#: Stricter than the page's: nothing inline, and no other origin, not even the runner's.
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'"
)
_FIELDS: Final = ((b"content-security-policy", _POLICY.encode()),)
#: Files that load and run nothing, and the policy for them: that of the page has 300 bytes.
_INERT: Final = frozenset({".css", ".woff2"})
_NOTHING: Final = ((b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),)
_HELP_UNBUILT: Final = (
    "The documentation is not part of this installation. In the folder of the source code, "
    "<code>make site</code> builds it; its texts are in the folder <code>docs</code> there."
)
_MISSING: Final = "There is no such page."


class File:
    """One file as it is sent. `lasting`: its name contains a hash of its content, so it never
    changes. `brotli`: the copy that the build has compressed; empty without one."""

    def __init__(self, body: bytes, suffix: str, *, lasting: bool, brotli: bytes = b"") -> None:
        media = _MEDIA.get(suffix, "application/octet-stream")
        self.media: Final = f"{media}; charset=utf-8" if suffix in _TEXTS else media
        self.body: Final = body
        self.etag: Final = f'"{hashlib.sha256(body).hexdigest()[:20]}"'
        self.lasting: Final = lasting
        self.fields: Final[Fields] = _NOTHING if suffix in _INERT else ()
        self.brotli: Final = brotli
        pays = suffix in _COMPRESSED and len(body) > _WORTH
        self._zipped: bytes | None = None if pays else b""

    async def encoded(self, accepted: bytes) -> tuple[bytes, bytes]:
        """Return the name of a content encoding and the body in it, chosen among those of an
        Accept-Encoding header. Both are empty if the body is sent as it is."""
        if self.brotli and accepts(accepted, b"br"):
            return b"br", self.brotli
        if accepts(accepted, b"gzip") and (zipped := await self.zipped()):
            return b"gzip", zipped
        return b"", b""

    async def zipped(self) -> bytes:
        """Return the gzip-compressed body; empty if compression saves nothing. It is compressed at
        the first request, on a thread: at the start there is no time for all files, and the
        largest takes a tenth of a second."""
        if self._zipped is None:
            self._zipped = await to_thread.run_sync(partial(gzip.compress, self.body, mtime=0))
        return self._zipped


def accepts(header: bytes, encoding: bytes) -> bool:
    """Return whether an Accept-Encoding header names a content encoding, and not with q=0."""
    for each in header.lower().split(b","):
        name, _, weight = each.partition(b";")
        if name.strip() == encoding:
            return not _REFUSED.fullmatch(weight.strip())
    return False


async def send_file(
    scope: HTTPScope, send: Send, file: File, status: int = 200, more: Fields = ()
) -> None:
    """Answer with a file, compressed if the client accepts that, or with 304 if the client has it
    already. `more` are additional headers, in place of those of the file."""
    asked = dict(scope["headers"])
    fields = [
        (b"etag", file.etag.encode()),
        (b"cache-control", b"max-age=31536000, immutable" if file.lasting else b"no-cache"),
        (b"vary", b"accept-encoding"),
        *(more or file.fields),
    ]
    body = file.body
    if status == 200 and asked.get(b"if-none-match") == file.etag.encode():
        body, status = b"", 304
    else:
        fields.append((b"content-type", file.media.encode()))
        encoding, encoded = await file.encoded(asked.get(b"accept-encoding", b""))
        if encoding:
            body = encoded
            fields.append((b"content-encoding", encoding))
        fields.append((b"content-length", str(len(body)).encode()))
    start: Any = {"type": "http.response.start", "status": status, "headers": fields}
    sent = b"" if scope["method"] == "HEAD" else body
    end: Any = {"type": "http.response.body", "body": sent, "more_body": False}
    await send(start)
    await send(end)


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
        """Return whether the page answers a path, which needs no session: `/`, a file of the page
        or, for a browser that wants HTML (`accepts_html`), any path that begins with none of
        `_NOT_PAGES`."""
        if path in self._files or path == "/":
            return True
        return accepts_html and not path.startswith(_NOT_PAGES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request for a file of the page or for an address that the page's router knows;
        pass other requests on. The parameters are those of ASGI."""
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
    read = {
        f"/{path.relative_to(folder).as_posix()}": path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.relative_to(folder).parts[0].startswith(".")
    }
    return {
        name: File(
            body,
            PurePosixPath(name).suffix,
            lasting="/assets/" in name,
            brotli=read.get(name + _BROTLI, b""),
        )
        for name, body in read.items()
        if not name.endswith(_BROTLI)
    }


class HelpSite:
    """An ASGI middleware that answers for `/help/` and passes other requests on.

    Files are read at the first request, and again when the site was built again. The site has
    relative links only, so it works below any path.
    """

    def __init__(self, app: ASGIApp, folder: Path) -> None:
        self._app = app
        self._folder = folder
        self._built: float | None = None
        self._paths: dict[str, Path] = {}
        self._files: dict[str, File] = {}

    @staticmethod
    def knows(path: str) -> bool:
        """Return whether a path is `/help` or below it, where the documentation is."""
        return path == _HELP or path.startswith(f"{_HELP}/")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with a file of the site, or with 404 for an unknown path below `/help/`; pass
        other requests on. The parameters are those of ASGI."""
        if (
            scope["type"] != ScopeType.HTTP
            or scope["method"] not in {"GET", "HEAD"}
            or not self.knows(scope["path"])
        ):
            await self._app(scope, receive, send)
        elif scope["path"] == _HELP:
            await _lead_below(send)
        else:
            await self._answer(scope, send)

    async def _answer(self, scope: HTTPScope, send: Send) -> None:
        name = scope["path"].removeprefix(f"{_HELP}/")
        found = await asyncio.to_thread(self._find, name)
        if found is not None:
            await send_file(scope, send, found, more=_FIELDS)
            return
        text = _MISSING if self._paths else _HELP_UNBUILT
        way = "" if not self._paths else f'<p><a href="{"../" * name.count("/")}./">Help</a></p>'
        page = _message(f"<p>{text}</p>{way}")
        await send_file(scope, send, page, status=404, more=_FIELDS)

    def _find(self, name: str) -> File | None:
        if name in {"", "index.html"}:
            self._renew()
            name = "index.html"
        if not self._paths:
            self._renew()
        path = self._paths.get(name)
        if path is None:
            return None
        if name not in self._files:
            try:
                self._files[name] = File(path.read_bytes(), path.suffix, lasting=False)
            except OSError:  # it is being built anew
                return None
        return self._files[name]

    def _renew(self) -> None:
        try:
            built = (self._folder / "index.html").stat().st_mtime
        except OSError:
            self._built, self._paths, self._files = None, {}, {}
            return
        if built != self._built:
            files = [each for each in self._folder.rglob("*") if each.is_file()]
            self._paths = {each.relative_to(self._folder).as_posix(): each for each in files}
            self._files, self._built = {}, built


def _message(body: str) -> File:
    text = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Help</title>{body}'
    return File(text.encode(), ".html", lasting=False)


async def _lead_below(send: Send) -> None:
    """Send a redirect (308) to `help/`. The address is relative, so that the redirect also works if
    a proxy serves this page below another path."""
    fields = [(b"location", b"help/"), (b"content-length", b"0")]
    start: Any = {"type": "http.response.start", "status": 308, "headers": fields}
    end: Any = {"type": "http.response.body", "body": b"", "more_body": False}
    await send(start)
    await send(end)
