"""Recognises the dialect of a file, and translates older dialects into D3.

See docs/umrf-and-the-engine.md 1.5.
"""

from typing import Final, NamedTuple

from action_assistant.umrf.files.older_dialects import (
    EFFECTS,
    OldFile,
    from_action,
    from_actions,
    from_umrf_actions,
    items_of,
)
from action_assistant.umrf.json.text import Json, Number, pointer
from action_assistant.umrf.model import Note, Problem
from action_assistant.umrf.relations import MAX_REFERRED_ID, whole_of


class Translation(NamedTuple):
    """A file in D3. Notes and problems name places of the given file, to which `origins` lead from
    the translated one (`origins.Origins`)."""

    file: dict[str, Json]
    notes: tuple[Note, ...] = ()
    problems: tuple[Problem, ...] = ()
    origins: dict[str, str] = {}  # noqa: RUF012 — never changed


_MARKS: Final = ("graph_name", "actions", "umrf_actions", "graph_entry", "graph_exit")
_PARAMETERS: Final = ("input_parameters", "output_parameters")
_TYPES: Final = ("sync", "async", "spontaneous")
_ACTION_FIELDS: Final = {
    "name", "instance_id", "type", "actor", "description", "state", "runtime", "input_parameters",
    "output_parameters", "parents", "children", "gui_attributes", "effect", "id", "suffix",
    "package_name", "library_path", "notation",
}  # fmt: skip
#: The types of JavaScript packages, which have a name and a type as well.
_FOREIGN_TYPES: Final = ("module", "commonjs")


def dialect_of(file: dict[str, Json]) -> str | None:
    """Return the name of the dialect, or None if the file is no UMRF.

    `D3`: current graphs. `D3-designer`: with entry and exit as objects. `D2`: of 2023. `D1`: with
    `umrf_actions`; `D1'`: the same written by a language model. `D3-action` and `D0`: single
    actions.
    """
    if not any(mark in file for mark in _MARKS):
        return action_dialect(file) if _is_action(file) else None
    if "umrf_actions" in file and "actions" not in file:
        members = {"effect", "type", "package_name"}
        full = any(members & action.keys() for action in items_of(file, "umrf_actions"))
        return "D1" if full else "D1'"
    ends = [file.get("graph_entry"), file.get("graph_exit")]
    if any(isinstance(end, dict) and isinstance(end.get("actions"), list) for end in ends):
        return "D3-designer"
    actions = list(items_of(file, "actions"))
    no_ends = len(actions) > 1 and not file.keys() & {"graph_entry", "graph_exit"}
    return "D2" if no_ends or any(map(_is_d2, actions)) else "D3"


def _is_action(file: dict[str, Json]) -> bool:
    """Return whether a file has members that only actions have. Many other files have the required
    name and type, too."""
    if any(isinstance(file.get(side), dict) for side in _PARAMETERS):
        return bool(file.keys() & {"name", "type", "effect"})
    if (effect := file.get("effect")) and isinstance(effect, str) and effect in EFFECTS:
        return bool(file.keys() & {"name", "suffix", "package_name"})
    kind = file.get("type")
    if not isinstance(file.get("name"), str) or not isinstance(kind, str):
        return False
    return kind in _TYPES or (file.keys() <= _ACTION_FIELDS and kind not in _FOREIGN_TYPES)


def action_dialect(file: dict[str, Json]) -> str | None:
    """Return the dialect of a file that is expected to describe one action, as the engine sees it:
    with a name and a type. None for a graph, and for a file without members of an action."""
    if any(mark in file for mark in _MARKS):
        return None
    members = file.keys() & {"name", "type", "effect", "suffix", "package_name", *_PARAMETERS}
    if len(members) < 2:
        return None
    return "D3-action" if "type" in file else "D0"


def _is_d2(action: dict[str, Json]) -> bool:
    return isinstance(action.get("state"), Number) or any(
        "condition" in parent and "conditions" not in parent
        for parent in items_of(action, "parents")
    )


def translated(file: dict[str, Json], dialect: str) -> Translation:
    """Translate a UMRF file of this dialect into D3, the dialect of current graphs. The result also
    has remarks on what was translated, and the problems for which the engine refuses the original.
    A file that is in D3 already is returned unchanged."""
    match dialect:
        case "D3-designer":
            old = _from_designer(file)
        case "D2":
            old = from_actions(file)
        case "D1" | "D1'":
            old = from_umrf_actions(file, shallow=dialect == "D1'")
        case "D0" | "D3-action":
            old = from_action(file)
        case _:
            return Translation(file)
    renumber(old)
    return Translation(old.file, old.notes.all(), tuple(old.problems), old.origins)


def _from_designer(file: dict[str, Json]) -> OldFile:
    old = OldFile(file)
    positions: dict[str, Json] = {}
    for end in ("entry", "exit"):
        field = f"graph_{end}"
        value = file.get(field)
        if not isinstance(value, dict) or not isinstance(value.get("actions", []), list):
            continue  # an end that is not in the designer's form stays as it is
        path = pointer(field)
        old.file[field] = value.get("actions", [])
        old.origins[path] = pointer(field, "actions")
        old.note(f"{field} was an object and is a list now.", path)
        old.refuse(path, f"{field} is an object, not a list; the engine refuses the file.")
        attributes = value.get("gui_attributes")
        point = attributes.get("position") if isinstance(attributes, dict) else None
        if isinstance(point, dict):
            positions[end] = point
        for lost in sorted(value.keys() - {"actions", "gui_attributes"}):
            text = f"{field} had a member without a place: “{lost}”."
            old.note(text, path + pointer(lost))
        for lost in (
            sorted(attributes.keys() - {"position"}) if isinstance(attributes, dict) else ()
        ):
            text = f"The gui_attributes of {field} had a member without a place: “{lost}”."
            old.note(text, path + pointer("gui_attributes", lost))
    if positions:
        _add_attributes(old.file, positions)
    return old


def _add_attributes(file: dict[str, Json], ours: dict[str, Json]) -> None:
    attributes = file.get("gui_attributes")
    joined = dict(attributes) if isinstance(attributes, dict) else {}
    inner = joined.get("action_assistant")
    joined["action_assistant"] = {**(inner if isinstance(inner, dict) else {}), **ours}
    file["gui_attributes"] = joined


def renumber(old: OldFile) -> None:
    """Change the file in place: each action whose `instance_id` no relation can refer to gets the
    lowest free one."""
    file = old.file
    actions = file.get("actions")
    if not isinstance(actions, list):
        return
    used: dict[str, set[int]] = {}
    large: dict[tuple[str, str], int] = {}
    for index, action in enumerate(actions):
        if isinstance(action, dict) and isinstance(name := action.get("name", ""), str):
            number, fits = whole_of(action.get("instance_id", Number("0")))
            if fits and number <= MAX_REFERRED_ID:
                used.setdefault(name, set()).add(number)
            elif isinstance(spelled := action.get("instance_id"), Number):
                large.setdefault((name, spelled.text), index)
    new: dict[tuple[str, str], int] = {}
    lowest: dict[str, int] = {}
    for (name, spelled_text), index in large.items():
        taken = used.setdefault(name, set())
        number = lowest.get(name, 0)
        while number in taken:
            number += 1
        taken.add(number)
        lowest[name] = number + 1
        new[name, spelled_text] = number
        place = old.at(pointer("actions", index, "instance_id"))
        old.note(f"{name} had the number {spelled_text}, now {number}.", place)
    if not new:
        return
    file["actions"] = [_renumbered_action(action, new) for action in actions]
    for end in ("graph_entry", "graph_exit"):
        if isinstance(items := file.get(end), list):
            file[end] = [_renumbered(item, new) for item in items]


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
