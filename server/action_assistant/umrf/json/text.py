"""Parses and prints JSON text within bounds, and keeps the spelling of numbers.

Python's own scanner does the reading. Size, nesting and the number of values are checked before;
double keys, NaN and spelling through its hooks. So no input costs more than its size.
"""

import json
import math
import re
from collections.abc import Iterator
from itertools import accumulate
from json.encoder import encode_basestring as quote
from typing import Annotated, Any, Final, NoReturn, TypeAlias

import msgspec

from action_assistant.safe_text import sentence
from action_assistant.umrf.json.places import doubled_in, path_at, place_at, places_of
from action_assistant.umrf.json.places import pointer as pointer

_OBJECT: Final[dict[str, Any]] = {"type": "object", "additionalProperties": True}

#: Any JSON object.
JsonObject: TypeAlias = Annotated[msgspec.Raw, msgspec.Meta(extra_json_schema=_OBJECT)]
#: A graph in an answer, with its numbers spelled as they were given.
UmrfGraph: TypeAlias = Annotated[
    msgspec.Raw, msgspec.Meta(extra_json_schema={**_OBJECT, "description": "A UMRF graph."})
]


MAX_BYTES: Final = 10 * 1024 * 1024
MAX_DEPTH: Final = 64
MAX_VALUES: Final = 1_000_000
#: The longest spelling of a number; a double needs 25 characters.
MAX_NUMBER: Final = 1_000

_STRING: Final = re.compile(r'"(?:[^"\\]|\\.)*+(?:"|\\?\Z)', re.DOTALL)
_NOT_STRUCTURE: Final = re.compile(r"[^\[\]{},]+")
_SURROGATE: Final = re.compile(r"[\ud800-\udfff]|\\u[dD][89a-fA-F]")


class Unreadable(Exception):
    """Raised for a text that is no JSON, no UMRF, or beyond the limits.

    `path` is a JSON pointer into the text, empty for all of it; `line` and `column` count
    characters from 1.
    """

    def __init__(
        self,
        code: str,
        message: str,
        *,
        path: str = "",
        line: int = 1,
        column: int = 1,
    ) -> None:
        message = sentence(message)
        super().__init__(message)
        self.code = code
        self.message = message
        self.path = path
        self.line = line
        self.column = column


class Number(msgspec.Struct, frozen=True):
    """A number in its original spelling."""

    text: str

    @property
    def value(self) -> float:
        """The value as the double that the engine reads."""
        return float(self.text)


Json: TypeAlias = "dict[str, Json] | list[Json] | str | bool | Number | None"


def parse(text: str | bytes) -> Json:
    """Parse a JSON text. Raise `Unreadable` if it is not UTF-8 or no JSON, has a key twice in one
    object, is too large or nested too deeply, or has a number too big for the engine or a lone
    surrogate."""
    text = decoded(text)
    _bound(text)
    hooks = _Hooks(text)
    try:
        value: Json = json.loads(
            text,
            object_pairs_hook=hooks.pairs,
            parse_int=hooks.number,
            parse_float=hooks.number,
            parse_constant=hooks.constant,
        )
    except json.JSONDecodeError as e:
        message = f"This is not JSON: {e.msg} at line {e.lineno}, column {e.colno}."
        raise Unreadable("not-json", message, line=e.lineno, column=e.colno) from None
    if hooks.doubled:
        _report_doubled(text)
    if _SURROGATE.search(text):
        _report_surrogate(value, text)
    return value


def parse_small(text: str) -> Json:
    """Parse the JSON text of one field. A text that is no JSON is returned as it is, without an
    error."""
    try:
        return parse(text)
    except Unreadable:
        return text.encode(errors="replace").decode()


def dump(value: Json) -> str:
    """Return compact JSON text; `parse` reads the same value from it."""
    out: list[str] = []
    _compact(value, out)
    return "".join(out)


def dump_indented(value: Json) -> str:
    """Return JSON text of a value, with an indentation of two blanks for each level."""
    out: list[str] = []
    _indented(value, "\n", out)
    return "".join(out)


def number(value: float) -> Number:
    """Return a Number with the shortest spelling of a value; a whole number has no point."""
    return Number(str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value))


class _Hooks:
    """Callbacks of the scanner for objects and numbers."""

    def __init__(self, text: str) -> None:
        self.doubled = False
        self._text = text

    def pairs(self, pairs: list[tuple[str, Json]]) -> dict[str, Json]:
        members = dict(pairs)
        self.doubled = self.doubled or len(members) < len(pairs)
        return members

    def number(self, text: str) -> Number:
        if len(text) > MAX_NUMBER or math.isinf(float(text)):
            line, column, path = self._where(text)
            message = f"The number {text[:30]}… at line {line}, column {column} is too big for the engine to read."
            raise Unreadable("number-too-big", message, path=path, line=line, column=column)
        return Number(text)

    def constant(self, name: str) -> NoReturn:
        line, column, _ = self._where(name)
        message = (
            f"This is not JSON: {name} at line {line}, column {column}; JSON knows no such number."
        )
        raise Unreadable("not-json", message, line=line, column=column)

    def _where(self, token: str) -> tuple[int, int, str]:
        """Return line, column and pointer of the first occurrence of a token; the scanner does not
        report its place."""
        offset = _without_strings(self._text).find(token)
        return *place_at(self._text, offset), path_at(self._text, offset)


def _without_strings(text: str) -> str:
    """Return JSON text with every string replaced by as many blanks, so that offsets stay valid."""
    return _STRING.sub(lambda found: " " * len(found[0]), text)


def decoded(text: str | bytes) -> str:
    """Return the text without a byte order mark. Raise `Unreadable` if it is larger than MAX_BYTES
    or not UTF-8."""
    if len(text) > MAX_BYTES:
        raise Unreadable("too-large", "The text is larger than 10 MB.")
    if isinstance(text, str):
        return text.removeprefix("\ufeff")
    try:
        return text.decode().removeprefix("\ufeff")
    except UnicodeDecodeError as e:
        line, column = place_at(
            start := text[: e.start].decode().removeprefix("\ufeff"), len(start)
        )
        message = f"The text is not UTF-8 (byte {e.start}, line {line})."
        raise Unreadable("not-utf-8", message, line=line, column=column) from None


def _bound(text: str) -> None:
    """Check a text before it is parsed. Raise `Unreadable` if it is nested too deeply or has too
    many values."""
    structure = _NOT_STRUCTURE.sub("", _STRING.sub("", text))
    if len(structure) > MAX_VALUES:
        raise Unreadable("too-large", f"The text has more than {MAX_VALUES:,} values.")
    depth = 0
    for sign in structure.replace(",", ""):
        if sign in "[{":
            depth += 1
            if depth > MAX_DEPTH:
                raise _too_deep(text)
        else:
            depth -= 1


def _too_deep(text: str) -> Unreadable:
    signs = _without_strings(text)
    depths = accumulate((sign in "[{") - (sign in "]}") for sign in signs)
    line, column = place_at(text, next(n for n, depth in enumerate(depths) if depth > MAX_DEPTH))
    message = (
        f"The text is nested more than {MAX_DEPTH} levels deep at line {line}, column {column}."
    )
    return Unreadable("too-deep", message, line=line, column=column)


def _walk(value: Json, path: str = "") -> Iterator[tuple[str, Json]]:
    """Yield every value in a JSON value, with its JSON pointer below `path`; a value comes before
    its members."""
    yield path, value
    match value:
        case dict():
            for key, member in value.items():
                yield from _walk(member, path + pointer(key))
        case list():
            for index, member in enumerate(value):
                yield from _walk(member, path + pointer(index))
        case _:
            pass


def _report_doubled(text: str) -> NoReturn:
    found = doubled_in(text)
    assert found is not None, "the scanner saw a doubled key"
    path, offset = found
    line, column = place_at(text, offset)
    key = path.rpartition("/")[2].replace("~1", "/").replace("~0", "~")
    message = f"The key “{key}” stands twice in one object."
    raise Unreadable("double-key", message, path=path, line=line, column=column)


def _report_surrogate(value: Json, text: str) -> None:
    for path, found in _walk(value):
        texts = (
            list(found) if isinstance(found, dict) else [found] if isinstance(found, str) else []
        )
        if any("\ud800" <= sign <= "\udfff" for each in texts for sign in each):
            place = places_of(text, [path])[path]
            message = "A text contains half of a character pair."
            raise Unreadable(
                "lone-surrogate", message, path=place.path, line=place.line, column=place.column
            )


def _compact(value: Json, out: list[str]) -> None:
    match value:
        case dict():
            start = "{"
            for key, member in value.items():
                out.append(f"{start}{quote(key)}:")
                _compact(member, out)
                start = ","
            out.append("}" if value else "{}")
        case list():
            start = "["
            for member in value:
                out.append(start)
                _compact(member, out)
                start = ","
            out.append("]" if value else "[]")
        case _:
            out.append(_scalar(value))


def _indented(value: Json, newline: str, out: list[str]) -> None:
    inner = newline + "  "
    match value:
        case dict() if value:
            start = "{"
            for key, member in value.items():
                out.append(f"{start}{inner}{quote(key)}: ")
                _indented(member, inner, out)
                start = ","
            out.append(newline + "}")
        case list() if value:
            start = "["
            for member in value:
                out.append(start + inner)
                _indented(member, inner, out)
                start = ","
            out.append(newline + "]")
        case _:
            _compact(value, out)


def _scalar(value: str | bool | Number | None) -> str:
    match value:
        case str():
            return quote(value)
        case True:
            return "true"
        case False:
            return "false"
        case None:
            return "null"
        case Number():
            return value.text
