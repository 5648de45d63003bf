"""Built files as browsers get them: typed, compressed where that pays, and asked for again by a tag."""

import gzip
import hashlib
import mimetypes
from typing import Any, Final

import msgspec
from litestar.types import HTTPScope, Send

_COMPRESSED: Final = frozenset({".html", ".js", ".css", ".svg", ".json", ".webmanifest"})
_MEDIA: Final = {**mimetypes.types_map, ".webmanifest": "application/manifest+json"}

Fields = tuple[tuple[bytes, bytes], ...]


class File(msgspec.Struct, frozen=True):
    """One file as it is sent. `zipped` is empty where compression does not pay."""

    body: bytes
    zipped: bytes
    media: str
    etag: str
    lasting: bool


def file_of(body: bytes, suffix: str, *, lasting: bool) -> File:
    """A file from what it holds and the end of its name. `lasting`: its name says its content."""
    media = _MEDIA.get(suffix, "application/octet-stream")
    if suffix in {".html", ".js", ".css"}:
        media += "; charset=utf-8"
    zipped = gzip.compress(body, mtime=0) if suffix in _COMPRESSED and len(body) > 1000 else b""
    etag = f'"{hashlib.sha256(body).hexdigest()[:20]}"'
    return File(body, zipped, media, etag, lasting)


async def send_file(
    scope: HTTPScope, send: Send, file: File, status: int = 200, more: Fields = ()
) -> None:
    """Answer with a file, with the headers `more` beside those that it has by itself."""
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
        if file.zipped and b"gzip" in asked.get(b"accept-encoding", b""):
            body = file.zipped
            fields.append((b"content-encoding", b"gzip"))
        fields.append((b"content-length", str(len(body)).encode()))
    start: Any = {"type": "http.response.start", "status": status, "headers": fields}
    sent = b"" if scope["method"] == "HEAD" else body
    end: Any = {"type": "http.response.body", "body": sent, "more_body": False}
    await send(start)
    await send(end)
