"""Files of earlier engines (D0, D1, D1', D2) as D3 values, with a note on each translation (SPEC 1.5)."""

from collections.abc import Iterator
from typing import Final

from action_assistant.umrf.jsontext import Json, Number, pointer
from action_assistant.umrf.model import Problem, Where

_EFFECTS: Final = {"synchronous": "sync", "asynchronous": "async", "sync": "sync", "async": "async"}
_OUTCOMES: Final[dict[str, tuple[str, ...]]] = {
    "always": ("on_true", "on_false", "on_error"),
    "on_success": ("on_true",),
    "on_failure": ("on_false", "on_error"),
}
_FLAGS: Final = ("pvf_required", "pvf_updatable")


class Old:
    """One file under translation. Values that were parsed are not changed; copies are."""

    def __init__(self, file: dict[str, Json]) -> None:
        self.file = dict(file)
        self.notes: dict[str, int] = {}
        self.problems: list[Problem] = []

    def note(self, text: str) -> None:
        """Says that something was translated; equal notes are counted."""
        self.notes[text] = self.notes.get(text, 0) + 1

    def told(self) -> tuple[str, ...]:
        """All notes, each once."""
        return tuple(f"{text} ({n} times)" if n > 1 else text for text, n in self.notes.items())

    def refuse(self, path: str, message: str) -> None:
        """Says why the current engine refuses the file as it stands."""
        where = Where(path=path)
        problem = Problem(code="dialect-old", severity="error", where=where, message=message)
        self.problems.append(problem)


def from_umrf_actions(file: dict[str, Json], shallow: bool) -> Old:
    """D1 and D1': `umrf_actions` without entry and exit."""
    old = Old(file)
    actions = old.file.pop("umrf_actions")
    old.file["actions"] = actions
    old.note("“umrf_actions” became “actions”.")
    old.refuse(
        "/umrf_actions", "“umrf_actions” is an older form of “actions”; the engine refuses it."
    )
    _translate(old, shallow)
    return old


def from_actions(file: dict[str, Json]) -> Old:
    """D2: `actions` with `condition`, numbers as states, and perhaps no entry and exit."""
    old = Old(file)
    old.refuse(
        "", "The file has the form of an engine of 2023; the current one refuses or misreads it."
    )
    _translate(old, shallow=False)
    return old


def from_action(file: dict[str, Json]) -> Old:
    """D0, and a current action file: one action becomes a graph of its own."""
    name = file.get("name")
    graph: dict[str, Json] = {"graph_name": name if isinstance(name, str) else ""}
    graph["actions"] = [file]
    old = Old(graph)
    old.note("The file describes one action; it became a graph of this action alone.")
    if "type" not in file:
        old.refuse("", "The action has no “type”; the engine refuses the file.")
        _translate(old, shallow=True)
    if "name" not in file:
        old.refuse("", "The action has no “name”; the engine refuses the file.")
    return old


def _translate(old: Old, shallow: bool) -> None:
    if "graph_state" in old.file and not isinstance(old.file["graph_state"], str):
        del old.file["graph_state"]
        old.note("A number as “graph_state” was left out; it says how a past run stood.")
    actions = old.file.get("actions")
    if not isinstance(actions, list):
        return
    first: set[int] = set()
    changed: list[Json] = []
    for index, item in enumerate(actions):
        if not isinstance(item, dict):
            changed.append(item)
            continue
        item = dict(item)
        if _flag(item.pop("execute_first", None)):
            first.add(index)
        _action(old, item, shallow)
        changed.append(item)
    old.file["actions"] = changed
    _ends(old, changed, first)


def _action(old: Old, item: dict[str, Json], shallow: bool) -> None:
    _number(old, item)
    if "type" not in item:
        effect = item.get("effect")
        kind = _EFFECTS.get(effect) if isinstance(effect, str) else None
        item["type"] = kind or "sync"
        if kind is not None:
            del item["effect"]
            old.note(f"The effect “{effect}” became the type “{kind}”.")
        elif not shallow or effect is not None:
            old.note("An action without a known effect got the type “sync”.")
        else:
            old.note("An action without a type got the type “sync”.")
    state = item.get("state")
    if "state" in item and not isinstance(state, str):
        del item["state"]
        old.note("A number as “state” was left out; it says how a past run stood.")
    for field in ("package_name", "library_path", "notation"):
        if field in item:
            old.note(f"“{field}” has no place any more; it is kept, and the engine ignores it.")
    for side in ("input_parameters", "output_parameters"):
        value = item.get(side)
        if isinstance(value, dict):
            item[side] = _parameters(old, value)
    for side in ("parents", "children"):
        relations = item.get(side)
        if isinstance(relations, list):
            item[side] = [_relation(old, relation, side) for relation in relations]


def _number(old: Old, item: dict[str, Json]) -> None:
    """`id` and `suffix` were what `instance_id` is."""
    if "instance_id" in item:
        return
    for field in ("id", "suffix"):
        value = item.get(field)
        if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 10:
            value = Number(str(int(value)))
        if isinstance(value, Number):
            del item[field]
            item["instance_id"] = value
            old.note(f"“{field}” became “instance_id”.")
            return


def _relation(old: Old, relation: Json, side: str) -> Json:
    if isinstance(relation, str):
        old.note("A relation that was only a name became one with number 0.")
        return {"name": relation}
    if not isinstance(relation, dict):
        return relation
    relation = dict(relation)
    _number(old, relation)
    if side == "children":
        return relation
    required = relation.get("required")
    if isinstance(required, str) and required in ("true", "false"):
        relation["required"] = required == "true"
        old.note("“true” and “false” as texts became values.")
    if "stop_when_received" in relation:
        stops = _flag(relation.pop("stop_when_received"))
        if stops:
            relation["conditions"] = ["on_true -> stop", "on_false -> stop"]
            old.note("“stop_when_received” became the conditions “on_true/on_false -> stop”.")
    if isinstance(condition := relation.get("condition"), str) and "conditions" not in relation:
        conditions = _conditions(condition)
        if conditions is not None:
            del relation["condition"]
            relation["conditions"] = conditions
            told = ", ".join(str(c) for c in conditions if not str(c).endswith("ignore"))
            old.note(f"The condition “{condition}” became “{told}”.")
    return relation


def _conditions(text: str) -> list[Json] | None:
    precondition, arrow, response = (part.strip() for part in text.partition("->"))
    outcomes = _OUTCOMES.get(precondition, (precondition,))
    if not arrow or not response:
        return None
    every = ("on_true", "on_false", "on_error", "on_stopped")
    if not set(outcomes) <= set(every):
        return None
    return [f"{outcome} -> {response if outcome in outcomes else 'ignore'}" for outcome in every]


def _parameters(old: Old, group: dict[str, Json]) -> dict[str, Json]:
    changed: dict[str, Json] = {}
    for key, value in group.items():
        if isinstance(value, dict):
            changed[key] = _parameters(old, value)
        elif key in _FLAGS and isinstance(value, str) and value in ("true", "false"):
            changed[key] = value == "true"
            old.note("“true” and “false” as texts became values.")
        else:
            changed[key] = value
    return changed


def _flag(value: Json) -> bool:
    return value is True or value == "true"


def _ends(old: Old, actions: list[Json], first: set[int]) -> None:
    """Entry: actions without parents, or marked to be first; exit: actions without children."""
    if "graph_entry" in old.file or "graph_exit" in old.file:
        return
    listed = [(i, item) for i, item in enumerate(actions) if isinstance(item, dict)]
    has_parents = {_name(child) for _, item in listed for child in _items(item, "children")}
    has_children = {_name(parent) for _, item in listed for parent in _items(item, "parents")}
    entries: list[Json] = []
    exits: list[Json] = []
    for index, item in listed:
        name = _name(item)
        reference: Json = {"name": name[0], "instance_id": Number(name[1])}
        if index in first or not (_items(item, "parents") or name in has_parents):
            entries.append(reference)
        if not (_items(item, "children") or name in has_children):
            exits.append(reference)
    old.file["graph_entry"] = entries
    old.file["graph_exit"] = exits
    old.note("Actions without parents, or marked to be first, became the entry.")
    old.note("Actions without children became the exit.")
    for field, found in (("graph_entry", entries), ("graph_exit", exits)):
        if listed and not found:
            old.note(f"No action is fit to be in {field}: the graph is one loop.")
            old.refuse(pointer(field), f"{field} is missing and cannot be told from the actions.")


def _items(item: dict[str, Json], side: str) -> list[dict[str, Json]]:
    value = item.get(side)
    return [r for r in value if isinstance(r, dict)] if isinstance(value, list) else []


def _name(item: dict[str, Json]) -> tuple[str, str]:
    name, number = item.get("name"), item.get("instance_id")
    return (
        name if isinstance(name, str) else "",
        number.text if isinstance(number, Number) else "0",
    )


def items_of(file: dict[str, Json], field: str) -> Iterator[dict[str, Json]]:
    """The objects in one of a file's lists."""
    value = file.get(field)
    for item in value if isinstance(value, list) else []:
        if isinstance(item, dict):
            yield item
