"""The values of the document: total functions from anything to a value or nothing.

The document can hold whatever some client wrote. A value that does not fit is left where it is and
read as if it were absent, here and in `frontend/src/graph/values.ts` alike.
"""

import json
import math
import re
from typing import Final, Literal, NamedTuple, TypeAlias, cast

from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    RESPONSES,
    Direction,
    Key,
    Position,
    Relation,
    Response,
)

Root: TypeAlias = Literal["meta", "actions", "relations", "positions", "comments"]
ROOTS: Final[tuple[Root, ...]] = ("meta", "actions", "relations", "positions", "comments")

_AID: Final = re.compile(r"[A-Za-z0-9]{12}")
_LISTING: Final = re.compile(r"[1-9][0-9]{0,8}")
_MAX_INSTANCE_ID: Final = 2**32 - 1
_MAX_DEPTH: Final = 64


class Ends(NamedTuple):
    """The parts of a relation's id: `<parent>><child>`, and `;n` from the second listing on."""

    parent: Key
    child: Key
    listing: int


def is_aid(text: str) -> bool:
    """Return whether this text can be the key of an action in a document."""
    return _AID.fullmatch(text) is not None


def relation_id(relation: Relation | Ends) -> str:
    """Return the id of a relation. The keys of its fields in the document begin with this id."""
    pair = f"{relation.parent}>{relation.child}"
    return f"{pair};{relation.listing}" if relation.listing else pair


def ends_of(head: str) -> Ends | None:
    """Return the ends of the relation with the id `head`; None if the text is no id of a relation."""
    parent, arrow, rest = head.partition(">")
    child, semicolon, count = rest.partition(";")
    if not arrow or (semicolon and not _LISTING.fullmatch(count)):
        return None
    if not is_aid(child if parent == ENTRY else parent):
        return None
    if child != EXIT and not is_aid(child):
        return None
    return Ends(parent, child, int(count or 0))


def text(value: object) -> str | None:
    """Return the value if it is a text; None otherwise."""
    return value if isinstance(value, str) else None


def direction(value: object) -> Direction:
    """Return the direction in which a graph is drawn, from a value of a document; `down` for a
    missing or unknown value."""
    return "right" if value == "right" else "down"


def number(value: object) -> float | None:
    """Return the value as a finite number; None for any other value."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None


def instance_id(value: object) -> int | None:
    """Return a whole number that the engine accepts as `instance_id` (32 bits, unsigned); None for
    any other value."""
    found = number(value)
    if found is None or not found.is_integer():
        return None
    return int(found) if 0 <= found <= _MAX_INSTANCE_ID else None


def position(value: object) -> Position | None:
    """Return the value as a pair of numbers; None for any other value."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    x, y = number(value[0]), number(value[1])
    return None if x is None or y is None else (x, y)


def response(value: object) -> Response | None:
    """Return the value if it is one of the six responses; None otherwise."""
    return value if isinstance(value, str) and value in RESPONSES else None


def json_text(value: object) -> str | None:
    """Return the value unchanged if it is a string of valid JSON, nested at most 64 levels deep;
    None for any other value."""
    if not isinstance(value, str):
        return None
    try:
        parsed = _parsed(value)
    except (ValueError, RecursionError):
        return None
    openings = value.count("[") + value.count("{")
    return value if openings <= _MAX_DEPTH or _depth(parsed, 0) <= _MAX_DEPTH else None


def text_list(value: object) -> list[str] | None:
    """Return the texts of a JSON list; None for any other value."""
    if not isinstance(value, str):
        return None
    try:
        parsed = _parsed(value)
    except (ValueError, RecursionError):
        return None
    fits = isinstance(parsed, list) and all(isinstance(item, str) for item in parsed)
    return cast("list[str]", parsed) if fits else None


def by_text(text: str) -> bytes:
    """Sort key: order of texts by UTF-16 code units, as in the browser."""
    return text.encode("utf-16-be", "surrogatepass")


def _parsed(text: str) -> object:
    # A number's digits do not matter here, and Python refuses to read very long ones.
    return json.loads(text, parse_int=len, parse_float=len, parse_constant=_refuse)


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _depth(value: object, above: int) -> int:
    """Return how deep a value is nested, counted from `above`; stop counting once it is too deep."""
    if not isinstance(value, dict | list) or above > _MAX_DEPTH:
        return above
    inner = value.values() if isinstance(value, dict) else value
    return max((_depth(item, above + 1) for item in inner), default=above + 1)
