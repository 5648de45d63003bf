"""Finds the line and column of JSON pointers in a text.

One pass over the tokens enters only the objects and lists that are asked for, so the cost is at
most the length of the text.
"""

import json
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from typing import Final

import msgspec

_TOKEN: Final = re.compile(r'"(?:[^"\\]|\\.)*+"|[\[\]{},:]|[^\s\[\]{},:"]+', re.DOTALL)
_BRACKET: Final = re.compile(r'(?:[^"\[\]{}]|"(?:[^"\\]|\\.)*+")*+([\[\]{}])', re.DOTALL)
_BLANK: Final = re.compile(r"[ \t\r\n]*")


def pointer(*keys: str | int) -> str:
    """Return the JSON pointer (RFC 6901) that leads through `keys`: names of members and indices of
    items."""
    path = ""
    for key in keys:
        if isinstance(key, str) and ("~" in key or "/" in key):
            path += "/" + key.replace("~", "~0").replace("/", "~1")
        else:
            path += f"/{key}"
    return path


class Place(msgspec.Struct, frozen=True):
    """The place of a value in a text. `line` and `column` (characters, both from 1): its beginning,
    with its key if it has one."""

    path: str
    line: int
    column: int


class _Wanted:
    """The pointers that are asked for, as a tree of keys."""

    __slots__ = ("below", "start")

    def __init__(self) -> None:
        self.below: dict[str, _Wanted] = {}
        self.start: int | None = None


def places_of(text: str, paths: Iterable[str]) -> dict[str, Place]:
    """Return the place in the JSON text of each pointer in `paths`. A pointer that leads nowhere
    has the place of the value in which it ends. The text must not have a key twice in one object.
    """
    paths = set(paths)
    root = _Wanted()
    for path in paths:
        node = root
        for key in _keys(path):
            node = node.below.setdefault(key, _Wanted())
    _find(text, root)
    lines = _Lines(text)
    return {path: _place(root, path, lines) for path in paths}


def _keys(path: str) -> list[str]:
    return [key.replace("~1", "/").replace("~0", "~") for key in path.split("/")[1:]]


def _place(root: _Wanted, path: str, lines: "_Lines") -> Place:
    node, keys = root, []
    for key in _keys(path):
        below = node.below[key]
        if below.start is None:
            break
        node = below
        keys.append(key)
    line, column = lines.of(node.start or 0)
    return Place(pointer(*keys), line, column)


def _find(text: str, root: _Wanted) -> None:
    """Set `start` in each wanted value below `root` to the offset at which it begins in the text."""
    root.start = _after_blanks(text, 0)
    above: list[
        tuple[_Wanted, int | None]
    ] = []  # open objects and lists, with the last item's number
    node, item = root, None
    value: _Wanted | None = root
    is_key = False
    at = 0
    while token := _TOKEN.search(text, at):
        at = token.end()
        sign = text[token.start()]
        if sign in "[{":
            if value is None or not value.below:
                at, value = _after(text, at), None
                continue
            above.append((node, item))
            node, item = value, 0 if sign == "[" else None
            is_key = sign == "{"
            value = _item(node, 0, text, at) if sign == "[" else None
        elif sign in "]}":
            node, item = above.pop()
            value, is_key = None, False
        elif sign == ",":
            is_key = item is None
            if item is not None:
                item += 1
                value = _item(node, item, text, at)
        elif is_key and sign == '"':
            value, is_key = node.below.get(key_of(token[0])), False
            if value is not None:
                value.start = token.start()
        elif sign != ":":
            value = None


def _after(text: str, at: int) -> int:
    """Return the offset in the text after the object or list that was opened just before the offset
    `at`."""
    depth = 1
    while depth and (bracket := _BRACKET.match(text, at)):
        depth += 1 if bracket[1] in "[{" else -1
        at = bracket.end()
    return at


def _after_blanks(text: str, at: int) -> int:
    blank = _BLANK.match(text, at)
    return blank.end() if blank else at


def _item(node: _Wanted, index: int, text: str, at: int) -> _Wanted | None:
    found = node.below.get(str(index))
    if found is not None and text[start := _after_blanks(text, at)] != "]":
        found.start = start
    return found


def key_of(token: str) -> str:
    """Return the text that a JSON string (`token`, with its quotes) spells."""
    return str(json.loads(token, strict=False)) if "\\" in token else token[1:-1]


def doubled_in(text: str) -> tuple[str, int] | None:
    """Return the JSON pointer of the first key that occurs twice in one object of a JSON text, and
    the offset in characters of its second occurrence; None if no key does."""
    for path, offset, fresh in _members(text):
        if not fresh:
            return path, offset
    return None


def path_at(text: str, offset: int) -> str:
    """Return the JSON pointer of the value that begins at an offset (in characters) of a text, or
    of the last one before it; "" if there is none."""
    last = ""
    for path, start, _ in _members(text):
        if start > offset:
            break
        last = path
    return last


def _members(text: str) -> Iterator[tuple[str, int, bool]]:
    """Yield every key and item: its pointer, its offset, and whether the key is new in its object.

    Also works on a text that is not valid JSON, as far as it resembles JSON.
    """
    heads: list[tuple[str, set[str] | int]] = []
    path, is_key = "", False
    for token in _TOKEN.finditer(text):
        sign = text[token.start()]
        if heads and sign not in "]}:" and (is_key or isinstance(heads[-1][1], int)):
            head, known = heads[-1]
            if isinstance(known, int) and sign != ",":
                path = head + pointer(known)
                yield path, token.start(), True
            elif is_key and sign == '"' and isinstance(known, set):
                key = key_of(token[0])
                path, is_key = head + pointer(key), False
                yield path, token.start(), key not in known
                known.add(key)
                continue
        if sign in "[{":
            heads.append((path, 0 if sign == "[" else set()))
            is_key = sign == "{"
        elif sign in "]}":
            path = heads.pop()[0] if heads else ""
            is_key = False
        elif sign == "," and heads:
            head, known = heads[-1]
            if isinstance(known, int):
                heads[-1] = (head, known + 1)
            is_key = isinstance(known, set)


def place_at(text: str, offset: int) -> tuple[int, int]:
    """Return the line and the column, both from 1, of an offset (in characters) of a text."""
    return text.count("\n", 0, offset) + 1, offset - text.rfind("\n", 0, offset)


class _Lines:
    """Finds line and column of many offsets of one text."""

    def __init__(self, text: str) -> None:
        self._starts = [0, *(found.end() for found in re.finditer("\n", text))]

    def of(self, offset: int) -> tuple[int, int]:
        """Return line and column of an offset, both from 1."""
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1
