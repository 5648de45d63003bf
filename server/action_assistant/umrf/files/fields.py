"""Reads single fields of files without losing values that do not fit."""

import re
from typing import Final, NamedTuple, TypeAlias

from action_assistant.umrf.json.text import Json, Number, dump
from action_assistant.umrf.model import Direction, Parameter, Position
from action_assistant.umrf.parameters import flatten
from action_assistant.umrf.relations import whole_of

AID: Final = re.compile(r"[A-Za-z0-9]{12}")
ZERO: Final = Number("0")

#: Unknown fields, and known ones whose value does not fit, with the text of their value.
Extra: TypeAlias = list[tuple[str, str]]


def text_of(item: dict[str, Json], field: str, extra: Extra, default: str = "") -> str:
    """Return the text in a field of a file's object, or `default` without one. Any other value is
    added to `extra`, the list of values that do not fit."""
    value = item.get(field, default)
    if isinstance(value, str):
        return value
    extra.append((field, dump(value)))
    return default


def number_of(item: dict[str, Json], extra: Extra) -> int:
    """Return the `instance_id` of an action in a file; a value that is not valid is also added to
    `extra`, the list of values that do not fit."""
    value = item.get("instance_id", ZERO)
    number, fits = whole_of(value)
    if not fits:
        extra.append(("instance_id", dump(value)))
    return number


def parameters_of(item: dict[str, Json], field: str, extra: Extra) -> tuple[Parameter, ...]:
    """Return the parameters in a field of a file's object (inputs or outputs); a value that is no
    object is added to `extra`, the list of values that do not fit."""
    value = item.get(field, {})
    if isinstance(value, dict):
        return flatten(value)
    extra.append((field, dump(value)))
    return ()


def is_runtime(value: Json) -> bool:
    """Return whether the engine can read a run log in a file: an object with a list of messages."""
    messages = value.get("messages") if isinstance(value, dict) else None
    return isinstance(messages, list) and all(
        isinstance(message, dict)
        and isinstance(message.get("timestamp"), Number)
        and isinstance(message.get("message"), str)
        for message in messages
    )


def graph_attributes(file: dict[str, Json]) -> tuple[dict[str, Json], str | None]:
    """Return this program's part of a graph's `gui_attributes`, and the JSON text of the other
    members, None if there are none."""
    if "gui_attributes" not in file:
        return {}, None
    value = file["gui_attributes"]
    ours = value.get("action_assistant") if isinstance(value, dict) else None
    if not isinstance(value, dict) or not isinstance(ours, dict):
        return {}, dump(value)
    rest = {key: member for key, member in value.items() if key != "action_assistant"}
    return ours, dump(rest) if rest else None


#: The member of an action's `gui_attributes` that names the inputs for which a start asks.
ASKS: Final = "ask_at_start"


class ActionAttributes(NamedTuple):
    """The attributes of an action in a file that this program knows: its position, its identity
    (aid), the marks of inputs that are asked for at a start, and the remainder as JSON text."""

    position: Position | None = None
    aid: str | None = None
    asks: tuple[tuple[str, str], ...] = ()
    rest: str | None = None


def action_attributes(item: dict[str, Json]) -> ActionAttributes:
    """Return what an action's `gui_attributes` say. What is invalid stays in the remainder."""
    if "gui_attributes" not in item:
        return ActionAttributes()
    value = item["gui_attributes"]
    if not isinstance(value, dict):
        return ActionAttributes(rest=dump(value))
    ours, point = value.get("action_assistant"), value.get("position")
    aid = ours.get("aid") if isinstance(ours, dict) else None
    position = position_of(point)
    rest = dict(value)
    if isinstance(ours, dict):
        del rest["action_assistant"]
    if position is not None and isinstance(point, dict):
        rest["position"] = {key: member for key, member in point.items() if key not in ("x", "y")}
        if not rest["position"]:
            del rest["position"]
    marks = rest.get(ASKS)
    asks: tuple[tuple[str, str], ...] = ()
    if isinstance(marks, dict) and marks and all(isinstance(each, dict) for each in marks.values()):
        asks = tuple(sorted((path, dump(mark)) for path, mark in marks.items()))
        del rest[ASKS]
    known = aid if isinstance(aid, str) and AID.fullmatch(aid) else None
    return ActionAttributes(position, known, asks, dump(rest) if rest or not value else None)


def direction_of(value: Json) -> Direction:
    """Return the direction in which a graph is drawn; `down` for a missing or unknown value."""
    return "right" if value == "right" else "down"


def position_of(value: Json) -> Position | None:
    """Return a position on the canvas from JSON data; None for a value that is no position."""
    if not isinstance(value, dict):
        return None
    x, y = value.get("x"), value.get("y")
    if not isinstance(x, Number) or not isinstance(y, Number):
        return None
    return x.value, y.value
