"""Translates files of earlier engines (D0, D1, D1', D2) into D3 values, with a note on each
translation.

See docs/umrf-and-the-engine.md 1.5.
"""

from collections.abc import Iterator
from typing import Final

from action_assistant.umrf.files.origins import origin
from action_assistant.umrf.json.text import Json, Number, pointer
from action_assistant.umrf.model import Problem, Severity, Where
from action_assistant.umrf.reports import Notes

EFFECTS: Final = {"synchronous": "sync", "asynchronous": "async", "sync": "sync", "async": "async"}
#: The fields of an action that name its neighbours; an action by itself has none.
RELATIONS: Final = ("parents", "children")
_OUTCOMES: Final[dict[str, tuple[str, ...]]] = {
    "always": ("on_true", "on_false", "on_error"),
    "on_success": ("on_true",),
    "on_failure": ("on_false", "on_error"),
}
_FLAGS: Final = ("pvf_required", "pvf_updatable")
#: The conditions of a parent that stops its child: only one that ended without error did so, and a stopped one
#: informed no child.
_STOPS: Final = (
    "on_true -> stop",
    "on_false -> stop",
    "on_error -> ignore",
    "on_stopped -> ignore",
)


class OldFile:
    """One file of an older dialect under translation. Parsed values are never changed, only copies.
    `origins` lead from the translated file to the original one (`origins.Origins`); notes and
    problems name places of the original one."""

    def __init__(self, file: dict[str, Json]) -> None:
        self.file = dict(file)
        self.notes = Notes()
        self.problems: list[Problem] = []
        self.origins: dict[str, str] = {}

    def at(self, path: str, member: str = "") -> str:
        """Return the place (JSON pointer), in the original file, of the value at `path` in the
        translated one, or of its former `member`."""
        return origin(self.origins, path) + (pointer(member) if member else "")

    def note(self, text: str, path: str) -> None:
        """Add the remark `text` that the value at `path`, a JSON pointer in the original file, was
        translated."""
        self.notes.add(text, path)

    def renamed(self, path: str, was: str, now: str) -> None:
        """Record that the member `was` of the value at `path` is called `now`."""
        self.origins[path + pointer(now)] = self.at(path, was)

    def refuse(self, path: str, message: str, code: str = "dialect-old") -> None:
        """Add a problem at `path` (JSON pointer in the original file): the current engine refuses
        the file, or for other codes than `dialect-old`, runs another graph."""
        where = Where(path=path)
        severity: Severity = "error" if code == "dialect-old" else "warning"
        self.problems.append(Problem(code=code, severity=severity, where=where, message=message))


def from_umrf_actions(file: dict[str, Json], shallow: bool) -> OldFile:
    """Translate a file of the dialects D1 and D1': `umrf_actions` without entry and exit.
    `shallow`: it is D1'."""
    old = OldFile(file)
    actions = old.file.pop("umrf_actions")
    old.file["actions"] = actions
    old.renamed("", "umrf_actions", "actions")
    old.note("“umrf_actions” became actions.", "/umrf_actions")
    old.refuse(
        "/umrf_actions", "“umrf_actions” is an older form of actions; the engine refuses it."
    )
    _translate(old, shallow)
    return old


def from_actions(file: dict[str, Json]) -> OldFile:
    """Translate a file of the dialect D2: `actions` with `condition`, numbers as states, and
    perhaps no entry and exit."""
    old = OldFile(file)
    old.refuse(
        "", "The file has the form of an engine of 2023; the current one refuses or misreads it."
    )
    _translate(old, shallow=False)
    return old


def from_action(file: dict[str, Json]) -> OldFile:
    """Translate a file of one action (D0, or current): the action becomes a graph of its own. The
    neighbours that it names are dropped, since they are in other files."""
    name = file.get("name")
    graph: dict[str, Json] = {"graph_name": name if isinstance(name, str) else ""}
    graph["actions"] = [{key: value for key, value in file.items() if key not in RELATIONS}]
    old = OldFile(graph)
    old.origins.update({"/actions": "", "/actions/0": "", "/graph_name": "/name"})
    old.note("The file describes one action; it became a graph of this action alone.", "")
    for field in RELATIONS:
        if file.get(field):
            old.note(f"“{field}” names neighbours of the action; they were left out.", f"/{field}")
    if "type" not in file:
        old.refuse("", "The action has no type; the engine refuses the file.")
        _actions(old, shallow=True)
    if "name" not in file:
        old.refuse("", "The action has no name; the engine refuses the file.")
    return old


def _translate(old: OldFile, shallow: bool) -> None:
    if "graph_state" in old.file and not isinstance(old.file["graph_state"], str):
        del old.file["graph_state"]
        text = "A number as “graph_state” was left out; it says how a past run stood."
        old.note(text, "/graph_state")
    first = _actions(old, shallow)
    if isinstance(actions := old.file.get("actions"), list):
        _ends(old, actions, first)


def _actions(old: OldFile, shallow: bool) -> set[int]:
    """Translate the actions of the file in place, and return the indices of those that are marked
    to be first. `shallow`: the dialect is D1' or D0."""
    actions = old.file.get("actions")
    first: set[int] = set()
    if not isinstance(actions, list):
        return first
    changed: list[Json] = []
    for index, item in enumerate(actions):
        if not isinstance(item, dict):
            changed.append(item)
            continue
        item = dict(item)
        if _is_flag(item.get("execute_first")) and _flag(item.pop("execute_first")):
            first.add(index)
        _action(old, item, pointer("actions", index), shallow)
        changed.append(item)
    old.file["actions"] = changed
    return first


def _action(old: OldFile, item: dict[str, Json], path: str, shallow: bool) -> None:
    _number(old, item, path)
    if "type" not in item:
        _type(old, item, path, shallow)
    if "state" in item and not isinstance(item["state"], str):
        del item["state"]
        text = "A number as “state” was left out; it says how a past run stood."
        old.note(text, old.at(path, "state"))
    for field in ("package_name", "library_path", "notation"):
        if field in item:
            text = f"“{field}” has no place any more; it is kept, and the engine ignores it."
            old.note(text, old.at(path, field))
    for side in ("input_parameters", "output_parameters"):
        value = item.get(side)
        if isinstance(value, dict):
            item[side] = _parameters(old, value, old.at(path, side))
    for side in RELATIONS:
        relations = item.get(side)
        if isinstance(relations, list):
            item[side] = [
                _relation(old, relation, f"{path}/{side}/{index}", side)
                for index, relation in enumerate(relations)
            ]


def _type(old: OldFile, item: dict[str, Json], path: str, shallow: bool) -> None:
    effect = item.get("effect")
    kind = EFFECTS.get(effect) if isinstance(effect, str) else None
    item["type"] = kind or "sync"
    if kind is not None:
        del item["effect"]
        old.renamed(path, "effect", "type")
        text = f"The effect “{effect}” became the type {kind}."
        old.note(text, old.at(path, "effect"))
    elif not shallow or effect is not None:
        text = "An action without a known effect got the type sync."
        old.note(text, old.at(path, "effect"))
    else:
        old.note("An action without a type got the type sync.", old.at(path))


def _number(old: OldFile, item: dict[str, Json], path: str) -> None:
    """Rename `id` or `suffix`, the former names of `instance_id`, in an action (`item`) at the JSON
    pointer `path`."""
    if "instance_id" in item:
        return
    for field in ("id", "suffix"):
        value = item.get(field)
        if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 10:
            value = Number(str(int(value)))
        if isinstance(value, Number):
            del item[field]
            item["instance_id"] = value
            old.renamed(path, field, "instance_id")
            old.note(f"“{field}” became instance_id.", old.at(path, field))
            return


def _relation(old: OldFile, relation: Json, path: str, side: str) -> Json:
    if isinstance(relation, str):
        old.note("A relation that was only a name became one with number 0.", old.at(path))
        return {"name": relation}
    if not isinstance(relation, dict):
        return relation
    relation = dict(relation)
    _number(old, relation, path)
    if side == "children":
        return relation
    required = relation.get("required")
    if isinstance(required, str) and required in ("true", "false"):
        relation["required"] = required == "true"
        old.note(f"The text “{required}” became a value.", old.at(path, "required"))
    stops = relation.get("stop_when_received")
    if _is_flag(stops) and "conditions" not in relation:
        del relation["stop_when_received"]
        if _flag(stops):
            _stop(old, relation, path)
    if isinstance(condition := relation.get("condition"), str) and "conditions" not in relation:
        conditions = _conditions(condition)
        if conditions is not None:
            del relation["condition"]
            relation["conditions"] = conditions
            old.renamed(path, "condition", "conditions")
            shown = ", ".join(str(c) for c in conditions if not str(c).endswith("ignore"))
            text = f"The condition “{condition}” became {shown}."
            old.note(text, old.at(path, "condition"))
    return relation


def _stop(old: OldFile, relation: dict[str, Json], path: str) -> None:
    """Translate an item of `parents` (`relation`, at the JSON pointer `path`) whose end stopped the
    child: it gets conditions that stop it. A problem is added to `old` if the child also waits for
    this parent: the older engine then never ran the child."""
    relation["conditions"] = list[Json](_STOPS)
    old.renamed(path, "stop_when_received", "conditions")
    place = old.at(path, "stop_when_received")
    old.note(
        "“stop_when_received” became the conditions on_true -> stop and on_false -> stop. When "
        "nothing is left to run then, the graph is HALTED, which the older engine called finished.",
        place,
    )
    if "required" not in relation:
        relation["required"] = False
        old.note("What stops an action is not waited for: it is not required.", old.at(path))
    elif relation["required"] is True:
        message = (
            "The action waits for a parent that is to stop it (“required” and “stop_when_received”). "
            "The older engine never ran such an action; that cannot be said any more. It now runs "
            "after its other parents, or never, and the graph may stay RUNNING for ever."
        )
        old.refuse(old.at(path), message, "stop-awaited")


def _conditions(text: str) -> list[Json] | None:
    precondition, arrow, response = (part.strip() for part in text.partition("->"))
    outcomes = _OUTCOMES.get(precondition, (precondition,))
    if not arrow or not response:
        return None
    every = ("on_true", "on_false", "on_error", "on_stopped")
    if not set(outcomes) <= set(every):
        return None
    return [f"{outcome} -> {response if outcome in outcomes else 'ignore'}" for outcome in every]


def _parameters(old: OldFile, group: dict[str, Json], path: str) -> dict[str, Json]:
    changed: dict[str, Json] = {}
    for key, value in group.items():
        inner = path + pointer(key)
        if isinstance(value, dict):
            changed[key] = _parameters(old, value, inner)
        elif key in _FLAGS and isinstance(value, str) and value in ("true", "false"):
            changed[key] = value == "true"
            old.note(f"The text “{value}” became a value.", inner)
        else:
            changed[key] = value
    return changed


def _flag(value: Json) -> bool:
    return value is True or value == "true"


def _is_flag(value: Json) -> bool:
    return isinstance(value, bool) or value in ("true", "false")


def _ends(old: OldFile, actions: list[Json], first: set[int]) -> None:
    """Add entry and exit to the file, if it has neither: actions without parents, or marked to be
    first (`first`: their indices), are the entry, and actions without children the exit."""
    if "graph_entry" in old.file or "graph_exit" in old.file:
        return
    listed = [(i, item) for i, item in enumerate(actions) if isinstance(item, dict)]
    has_parents = {_name(child) for _, item in listed for child in _items(item, "children")}
    has_children = {_name(parent) for _, item in listed for parent in _items(item, "parents")}
    entries: list[int] = []
    exits: list[int] = []
    for index, item in listed:
        name = _name(item)
        if index in first or not (_items(item, "parents") or name in has_parents):
            entries.append(index)
        if not (_items(item, "children") or name in has_children):
            exits.append(index)
    by_index = dict(listed)
    for field, found, rule in (
        (
            "graph_entry",
            entries,
            "Actions without parents, or marked to be first, became the entry.",
        ),
        ("graph_exit", exits, "Actions without children became the exit."),
    ):
        references: list[Json] = []
        for number, index in enumerate(found):
            name = _name(by_index[index])
            references.append({"name": name[0], "instance_id": Number(name[1])})
            old.origins[pointer(field, number)] = old.at(pointer("actions", index))
            old.note(rule, old.at(pointer("actions", index)))
        old.file[field] = references
    _say_missing(old, bool(listed), entries, exits)


def _say_missing(old: OldFile, any_action: bool, entries: list[int], exits: list[int]) -> None:
    for field, found, which, what in (
        ("graph_entry", entries, "a parent", "nothing would be started"),
        ("graph_exit", exits, "a child", "it never ends by itself as FINISHED"),
    ):
        if any_action and not found:
            message = f"Every action has {which}, so that none could be put into {field}: {what}."
            old.note(message, old.at("/actions"))
            text = f"{field} is missing and cannot be told from the actions."
            old.refuse(old.at("/actions"), text)


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
    """Yield the objects in the list in a field of a file; none if it is no list."""
    value = file.get(field)
    for item in value if isinstance(value, list) else []:
        if isinstance(item, dict):
            yield item
