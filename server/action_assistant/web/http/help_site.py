"""The built documentation below `/help/`, for whoever reaches the port: it says nothing of this server."""

import asyncio
from pathlib import Path
from typing import Any, Final

from litestar.enums import ScopeType
from litestar.types import ASGIApp, HTTPScope, Receive, Scope, Send

from action_assistant.web.http.static_files import File, send_file

_HELP: Final = "/help"
#: Stricter than the page's: nothing inline, and no other origin, not even the runner's.
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'"
)
_FIELDS: Final = ((b"content-security-policy", _POLICY.encode()),)
_UNBUILT: Final = (
    "The documentation is not part of this installation. In the folder of the source code, "
    "<code>make site</code> builds it; its texts are in the folder <code>docs</code> there."
)
_MISSING: Final = "There is no such page."


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
        """Return whether a path belongs to the documentation."""
        return path == _HELP or path.startswith(f"{_HELP}/")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send a file of the site, or a 404 for an unknown path below `/help/`; pass other requests
        on."""
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
        text = _MISSING if self._paths else _UNBUILT
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
