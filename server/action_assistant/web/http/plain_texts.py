"""The texts that requests may bring: refused here, once for all routes, where they would steer what shows
them or cannot be stored.

Contents of graphs are not looked at, since a file may hold anything, and it is kept as it is. What was
stored before stays readable; `safe_text` escapes it where it is shown.
"""

import re
from collections.abc import Iterator
from typing import Any, Final
from urllib.parse import unquote_to_bytes

import msgspec
from litestar import Request

from action_assistant.errors import BadInput
from action_assistant.safe_text import steering_in
from action_assistant.umrf.json.places import pointer

#: Fields with contents of graphs, scripts, and rows of another log.
_CONTENT: Final = frozenset(
    {"umrf", "subgraphs", "script", "changes", "editor_audit", "profile", "choices"}
)
#: Fields that name what exists already, or quote a compiler: an older name may have any character.
_QUOTED: Final = frozenset(
    [
        "action",
        "actions",
        "aid",
        "before",
        "codes",
        "continue_from",
        "engine",
        "engines",
        "errors",
        "graph",
        "graphs",
        "like",
        "of",
        "record",
        "renames",
        "replace",
        "robots",
        "run",
    ]
)
_MAY_STEER: Final = re.compile(
    rb"\\(u(00[0189][0-9a-f]|007f|20[26])|[bf])|[\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\xa8-\xae]|\xe2\x81[\xa6-\xa9]",
    re.IGNORECASE,
)


class PlainRequest(Request[Any, Any, Any]):
    """A request whose JSON body has only texts that can be stored and shown."""

    async def json(self) -> Any:
        """Return the decoded body. Raise BadInput, with the place, for a text that is refused."""
        require_plain(await self.body())
        return await super().json()


def require_plain(body: bytes) -> None:
    """Raise BadInput, with the place, if a JSON body has a text that steers what shows it, or that is no
    text. A body that is no JSON is left to whoever decodes it."""
    try:
        body.decode()
    except UnicodeDecodeError as error:
        raise BadInput(f"The body is not UTF-8: byte {error.start} of it.") from error
    try:
        fields = msgspec.json.decode(body, type=dict[str, msgspec.Raw])
    except msgspec.DecodeError:
        return
    for name, raw in fields.items():
        _require("", name)
        if name not in _CONTENT and _MAY_STEER.search(raw):
            for place, text in _texts(msgspec.json.decode(raw), (name,)):
                _require(pointer(*place), text, is_quoted=not _QUOTED.isdisjoint(place))


def require_plain_address(raw_path: bytes, query: bytes) -> None:
    """Raise BadInput if the path or the query of a request is not UTF-8, or has a NUL in it."""
    for name, raw in (("path", raw_path), ("query", query)):
        if b"%" not in raw:
            continue
        try:
            text = unquote_to_bytes(raw).decode()
        except UnicodeDecodeError as error:
            raise BadInput(f"The {name} of the address is not UTF-8.") from error
        if "\0" in text:
            raise BadInput(f"The {name} of the address has the character NUL.")


def _texts(value: Any, place: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield all texts in a JSON value, also the keys of objects, with their places."""
    match value:
        case str():
            yield place, value
        case list():
            for number, each in enumerate(value):
                yield from _texts(each, (*place, number))
        case dict():
            for key, each in value.items():
                yield place, key
                if key not in _CONTENT:
                    yield from _texts(each, (*place, key))


def _require(place: str, text: str, *, is_quoted: bool = False) -> None:
    found = steering_in(text)
    if found is None or (is_quoted and "\0" not in text):
        return
    shown = "NUL" if found == "\0" else f"U+{ord(found):04X}"
    raise BadInput(
        f"A text here has no control characters, and this one has {shown}.",
        where={"path": place},
    )
