"""Built files as browsers get them: typed, compressed where that pays, and asked for again by a tag."""

import gzip
import hashlib
import mimetypes
from functools import partial
from typing import Any, Final

from anyio import to_thread
from litestar.types import HTTPScope, Send

_COMPRESSED: Final = frozenset({".html", ".js", ".css", ".svg", ".json", ".webmanifest"})
_TEXTS: Final = frozenset({".html", ".js", ".css"})
_WORTH: Final = 1000  # bytes
_MEDIA: Final = {**mimetypes.types_map, ".webmanifest": "application/manifest+json"}

Fields = tuple[tuple[bytes, bytes], ...]


class File:
    """One file as it is sent. `lasting`: its name contains a hash of its content, so it never
    changes."""

    def __init__(self, body: bytes, suffix: str, *, lasting: bool) -> None:
        media = _MEDIA.get(suffix, "application/octet-stream")
        self.media: Final = f"{media}; charset=utf-8" if suffix in _TEXTS else media
        self.body: Final = body
        self.etag: Final = f'"{hashlib.sha256(body).hexdigest()[:20]}"'
        self.lasting: Final = lasting
        pays = suffix in _COMPRESSED and len(body) > _WORTH
        self._zipped: bytes | None = None if pays else b""

    async def zipped(self) -> bytes:
        """Return the gzip-compressed body; empty if compression saves nothing. It is compressed at
        the first request, on a thread: at the start there is no time for all files, and the
        largest takes a tenth of a second."""
        if self._zipped is None:
            self._zipped = await to_thread.run_sync(partial(gzip.compress, self.body, mtime=0))
        return self._zipped


async def send_file(
    scope: HTTPScope, send: Send, file: File, status: int = 200, more: Fields = ()
) -> None:
    """Answer with a file; `more` are additional headers."""
    asked = dict(scope["headers"])
    fields = [
        (b"etag", file.etag.encode()),
        (b"cache-control", b"max-age=31536000, immutable" if file.lasting else b"no-cache"),
        (b"vary", b"accept-encoding"),
        *more,
    ]
    body = file.body
    if status == 200 and asked.get(b"if-none-match") == file.etag.encode():
        body, status = b"", 304
    else:
        fields.append((b"content-type", file.media.encode()))
        if b"gzip" in asked.get(b"accept-encoding", b"") and (zipped := await file.zipped()):
            body = zipped
            fields.append((b"content-encoding", b"gzip"))
        fields.append((b"content-length", str(len(body)).encode()))
    start: Any = {"type": "http.response.start", "status": status, "headers": fields}
    sent = b"" if scope["method"] == "HEAD" else body
    end: Any = {"type": "http.response.body", "body": sent, "more_body": False}
    await send(start)
    await send(end)
