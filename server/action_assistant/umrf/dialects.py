"""Which dialect a file is written in, and older ones translated into D3 (SPEC 1.5)."""

from typing import Final

from action_assistant.umrf.dialects_old import (
    from_action,
    from_actions,
    from_umrf_actions,
    items_of,
)
from action_assistant.umrf.jsontext import Json, Number
from action_assistant.umrf.model import Problem, Where
from action_assistant.umrf.relations import MAX_REFERRED_ID, whole_of

Translation = tuple[dict[str, Json], tuple[str, ...], tuple[Problem, ...]]

_MARKS: Final = ("graph_name", "actions", "umrf_actions", "graph_entry", "graph_exit")
_ACTION_MARKS: Final = ("name", "type", "effect", "suffix", "package_name", "input_parameters")


def dialect_of(file: dict[str, Json]) -> str | None:
    """The name of the dialect, or None for what is no UMRF.

    `D3` current graphs, `D3-designer` with entry and exit as objects, `D2` of 2023, `D1` with
    `umrf_actions`, `D1'` the same from a language model, `D3-action` and `D0` single actions.
    """
    if not any(mark in file for mark in _MARKS):
        return _action_dialect(file)
    if "umrf_actions" in file and "actions" not in file:
        told = {"effect", "type", "package_name"}
        full = any(told & action.keys() for action in items_of(file, "umrf_actions"))
        return "D1" if full else "D1'"
    ends = [file.get("graph_entry"), file.get("graph_exit")]
    if any(isinstance(end, dict) and isinstance(end.get("actions"), list) for end in ends):
        return "D3-designer"
    actions = list(items_of(file, "actions"))
    no_ends = len(actions) > 1 and not file.keys() & {"graph_entry", "graph_exit"}
    return "D2" if no_ends or any(map(_is_d2, actions)) else "D3"


def _action_dialect(file: dict[str, Json]) -> str | None:
    if sum(mark in file for mark in _ACTION_MARKS) < 2:
        return None
    return "D3-action" if "type" in file else "D0"


def _is_d2(action: dict[str, Json]) -> bool:
    return isinstance(action.get("state"), Number) or any(
        "condition" in parent and "conditions" not in parent
        for parent in items_of(action, "parents")
    )


def translated(file: dict[str, Json], dialect: str) -> Translation:
    """The file in D3, notes on what was translated, and why the engine refuses it as it stands."""
    match dialect:
        case "D3-designer":
            return _from_designer(file)
        case "D2":
            old = from_actions(file)
        case "D1" | "D1'":
            old = from_umrf_actions(file, shallow=dialect == "D1'")
        case "D0" | "D3-action":
            old = from_action(file)
        case _:
            return file, (), ()
    return old.file, (*old.told(), *renumber(old.file)), tuple(old.problems)


def _from_designer(file: dict[str, Json]) -> Translation:
    file = dict(file)
    notes: list[str] = []
    problems: list[Problem] = []
    positions: dict[str, Json] = {}
    for end in ("entry", "exit"):
        field = f"graph_{end}"
        value = file.get(field)
        if not isinstance(value, dict):
            continue
        file[field] = value.get("actions", [])
        notes.append(f"{field} was an object and is a list now.")
        message = f"{field} is an object, not a list; the engine refuses the file."
        where = Where(path=f"/{field}")
        problems.append(Problem(code="dialect-old", severity="error", where=where, message=message))
        attributes = value.get("gui_attributes")
        point = attributes.get("position") if isinstance(attributes, dict) else None
        if isinstance(point, dict):
            positions[end] = point
        lost = sorted(value.keys() - {"actions", "gui_attributes"})
        if lost:
            notes.append(f"{field} had members without a place: {', '.join(lost)}.")
    if positions:
        _add_attributes(file, positions)
    notes.extend(renumber(file))
    return file, tuple(notes), tuple(problems)


def _add_attributes(file: dict[str, Json], ours: dict[str, Json]) -> None:
    attributes = file.get("gui_attributes")
    joined = dict(attributes) if isinstance(attributes, dict) else {}
    inner = joined.get("action_assistant")
    joined["action_assistant"] = {**(inner if isinstance(inner, dict) else {}), **ours}
    file["gui_attributes"] = joined


def renumber(file: dict[str, Json]) -> list[str]:
    """Gives actions whose `instance_id` no relation can refer to the lowest free one, in place of
    `file`'s members. Returns notes."""
    actions = file.get("actions")
    if not isinstance(actions, list):
        return []
    used: dict[str, set[int]] = {}
    large: list[tuple[str, str]] = []
    for action in actions:
        if isinstance(action, dict) and isinstance(name := action.get("name", ""), str):
            number, fits = whole_of(action.get("instance_id", Number("0")))
            if fits and number <= MAX_REFERRED_ID:
                used.setdefault(name, set()).add(number)
            elif isinstance(spelled := action.get("instance_id"), Number):
                large.append((name, spelled.text))
    new: dict[tuple[str, str], int] = {}
    lowest: dict[str, int] = {}
    for name, spelled_text in large:
        taken = used.setdefault(name, set())
        number = lowest.get(name, 0)
        while number in taken:
            number += 1
        taken.add(number)
        lowest[name] = number + 1
        new.setdefault((name, spelled_text), number)
    if not new:
        return []
    file["actions"] = [_renumbered_action(action, new) for action in actions]
    for end in ("graph_entry", "graph_exit"):
        if isinstance(items := file.get(end), list):
            file[end] = [_renumbered(item, new) for item in items]
    return [f"{name} had the number {text}, now {n}." for (name, text), n in new.items()]


def _renumbered_action(action: Json, new: dict[tuple[str, str], int]) -> Json:
    action = _renumbered(action, new)
    if not isinstance(action, dict):
        return action
    for side in ("parents", "children"):
        if isinstance(items := action.get(side), list):
            action[side] = [_renumbered(item, new) for item in items]
    return action


def _renumbered(item: Json, new: dict[tuple[str, str], int]) -> Json:
    if not isinstance(item, dict):
        return item
    name, spelled = item.get("name", ""), item.get("instance_id")
    if isinstance(name, str) and isinstance(spelled, Number) and (name, spelled.text) in new:
        return {**item, "instance_id": Number(str(new[name, spelled.text]))}
    return dict(item)
