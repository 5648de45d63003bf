"""Reads conditions, renamings and numbers of relations as the engine's parser reads them."""

import re
from typing import Final, get_args

import msgspec

from action_assistant.umrf.json.text import Json, Number
from action_assistant.umrf.model import (
    ENGINE_DEFAULTS,
    PRECONDITIONS,
    RESPONSES,
    Conditions,
    Precondition,
    Remap,
    Response,
)

#: The largest `instance_id` that a relation can refer to (16 bits in the engine).
MAX_REFERRED_ID: Final = 65_535
MAX_ID: Final = 2**32 - 1

_PRECONDITIONS: Final[dict[str, Precondition]] = {p: p for p in PRECONDITIONS}
_RESPONSES: Final[dict[str, Response]] = {r: r for r in RESPONSES}
_ARROW: Final = re.compile("[->]")

assert set(_RESPONSES) == set(get_args(Response))


def condition_of(text: Json) -> tuple[Precondition, Response] | None:
    """Parse a condition of a file, such as `"on_true -> run"`, into outcome and response; return
    None if the engine refuses it. Like the engine, ignore blanks, and everything after a second
    arrow; tabs are not ignored."""
    if not isinstance(text, str):
        return None
    parts = _ARROW.split(text.replace(" ", ""))
    if len(parts) < 3:
        return None
    precondition = _PRECONDITIONS.get(parts[0])
    response = _RESPONSES.get(parts[2])
    return (precondition, response) if precondition and response else None


def conditions_of(value: Json) -> tuple[Conditions, bool]:
    """Return the conditions that a list of texts in a file sets, and whether the engine could read
    the whole list. Outcomes that the list lacks have the engine's default response."""
    conditions = ENGINE_DEFAULTS
    if not isinstance(value, list):
        return conditions, False
    fits = True
    for text in value:
        read = condition_of(text)
        if read is None:
            fits = False
        else:
            conditions = msgspec.structs.replace(conditions, **{read[0]: read[1]})
    return conditions, fits


def conditions_text(conditions: Conditions) -> list[Json]:
    """Return the four conditions as a list of texts in the form of a file."""
    return [f"{outcome} -> {conditions.answer(outcome)}" for outcome in PRECONDITIONS]


def remap_of(value: Json) -> tuple[tuple[Remap, ...], bool, bool]:
    """Return the renamings that a list in a file spells (() if the engine refuses it), whether the
    engine accepts the list, and whether its items have no members beyond `from` and `to`."""
    if not isinstance(value, list):
        return (), False, False
    found: dict[str, Remap] = {}
    plain = True
    for item in value:
        if not isinstance(item, dict):
            return (), False, False
        source, target = item.get("from"), item.get("to")
        if not isinstance(source, str) or not isinstance(target, str) or source in found:
            return (), False, False
        found[source] = Remap(source, target)
        plain = plain and len(item) == 2
    return tuple(found.values()), True, plain


def whole_of(value: Json) -> tuple[int, bool]:
    """Return the number that the engine reads from an `instance_id` of a file, and whether that
    value is valid: a whole number that is not negative."""
    match value:
        case Number(text=text):
            exact = text.lstrip("-").isdigit()
            number = int(text) if exact else int(float(text))
            fits = 0 <= number <= MAX_ID and (exact or float(text).is_integer())
            return (number if fits else number % (MAX_ID + 1)), fits
        case str() if value.isascii() and value.isdigit() and len(value) <= 10:
            return int(value) % (MAX_ID + 1), False
        case _:
            return 0, False
