"""Values of parameters as texts: those that were sent, and those that an engine reported.

Both are written the same way, so that `5` and `5.0`, which are one double to the engine, are one text.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Final

import msgspec

from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import MAX_DEPTH, Unreadable, parse
from action_assistant.umrf.parameters import flatten
from action_assistant.umrf.semantics.values import Opaque, Slot, slots_of

#: Characters of one value. A longer one is cut and ends with an ellipsis: it is for people.
LONGEST: Final = 300
#: The most parameters of one action: an engine is not trusted to send fewer.
MOST: Final = 100

#: Flat name (`pose::x`) → JSON text of the value.
Values = dict[str, str]


def values_of(slots: Iterable[Slot]) -> Values:
    """Return the values of parameters as JSON texts by flat name. `slots`: the parameters with
    their values. Not included are parameters without a value or with an `Opaque` one (of a type
    that cannot be read), and all after the first `MOST`. Names and texts are cut to `LONGEST`
    characters."""
    found: Values = {}
    for slot in slots:
        if slot.has_value() and not isinstance(slot.value, Opaque) and len(found) < MOST:
            found[slot.name[:LONGEST]] = _text(slot.value)
    return found


def reported(text: bytes) -> Values | None:
    """Return the values in `text`, the JSON text that an engine reports as `input_parameters`, in
    the form of `values_of`; None if the text is unreadable or no JSON object."""
    try:
        group = parse(text)
    except Unreadable:
        return None
    return values_of(slots_of(flatten(group)).values()) if isinstance(group, dict) else None


def sent(umrf: str) -> dict[str, Values]:
    """Return the input values in a graph text as it was sent, by full name of the action, as
    `values_of` does. Actions without values are not included; {} if the text cannot be read."""
    try:
        graph = codec.read(umrf.encode()).graph
    except codec.Unreadable:
        return {}
    found = {
        action.full_name: values_of(slots_of(action.inputs).values()) for action in graph.actions
    }
    return {name: values for name, values in found.items() if values}


def _text(value: Any) -> str:
    return shortened(msgspec.json.encode(_whole(value, MAX_DEPTH)).decode(errors="replace"))


def shortened(text: str) -> str:
    """Return the text of a value for people, cut to `LONGEST` characters."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def _whole(value: Any, depth: int) -> Any:
    match value:
        case float() if value.is_integer() and abs(value) < 1e15:
            return int(value)
        case list() if depth:
            return [_whole(member, depth - 1) for member in value]
        case Mapping() if depth:
            return {key: _whole(member, depth - 1) for key, member in value.items()}
        case _:
            return value
