"""Reads graphs from the nested values of a D3 file without losing anything (docs/contracts.md 1 and
2)."""

from collections import Counter
from collections.abc import Callable
from itertools import chain
from typing import Final, TypeAlias

import msgspec

from action_assistant.umrf.files.fields import (
    Extra,
    action_attributes,
    direction_of,
    graph_attributes,
    is_runtime,
    number_of,
    parameters_of,
    position_of,
    text_of,
)
from action_assistant.umrf.files.waypoints import with_waypoints
from action_assistant.umrf.json.text import Json, dump, pointer
from action_assistant.umrf.model import (
    ENGINE_DEFAULTS,
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Key,
    Note,
    Problem,
    Relation,
    Remap,
    Where,
)
from action_assistant.umrf.relations import conditions_of, remap_of
from action_assistant.umrf.reports import Notes, ProblemList

NODE_STATES: Final = {
    "UNINITIALIZED", "INITIALIZED", "RUNNING", "PAUSE_REQUESTED", "PAUSED", "STOPPING", "FINISHED",
    "BYPASSED", "ERROR",
}  # fmt: skip
GRAPH_STATES: Final = {
    "UNINITIALIZED", "INITIALIZED", "RUNNING", "PAUSED", "STOPPING", "STOPPED", "FINISHED", "ERROR",
    "HALTED", "CLEARING",
}  # fmt: skip
_GRAPH_FIELDS: Final = {
    "graph_name", "graph_description", "graph_state", "graph_entry", "graph_exit", "actions",
    "gui_attributes",
}  # fmt: skip
_ACTION_FIELDS: Final = {
    "name", "instance_id", "type", "actor", "description", "state", "runtime", "input_parameters",
    "output_parameters", "parents", "children", "gui_attributes",
}  # fmt: skip

_Kind: TypeAlias = "Callable[[int, dict[str, Json], Extra], _Side]"
_Name: TypeAlias = tuple[str, int]


class Tree(msgspec.Struct, frozen=True):
    """The result of `read_tree`. Problems and notes name places of the file that was read;
    `origins` lead there from the canonical text of the graph (`origins.Origins`)."""

    graph: Graph
    problems: tuple[Problem, ...]
    states: dict[Key, str]
    graph_state: str | None
    notes: tuple[Note, ...]
    origins: dict[str, str]


def read_tree(file: dict[str, Json]) -> Tree:
    """Read the graph of a D3 file. No file makes it fail: values that do not fit are stored in
    `extra` of the graph or reported as problems."""
    return _Reader().read(file)


class _Side(msgspec.Struct):
    """One item of an action's `parents` or `children`, or of an end of the graph."""

    order: float
    conditions: Conditions = ENGINE_DEFAULTS
    required: bool = True
    remap: tuple[Remap, ...] = ()
    extra: tuple[tuple[str, str], ...] = ()


class _Item(msgspec.Struct):
    """A place in a relations array that names another action."""

    owner: int
    name: str
    instance_id: int
    side: _Side


class _Reader:
    def __init__(self) -> None:
        self.problems = ProblemList()
        self.states: dict[Key, str] = {}
        self.actions: list[Action] = []
        self.by_name: dict[_Name, list[int]] = {}
        self.listed: list[list[_Item]] = []
        self.listing: list[list[_Item]] = []
        self.notes = Notes()
        self.origins: dict[str, str] = {}

    def report(self, code: str, path: str, message: str) -> None:
        if self.problems.has_room("error", code):
            where = Where(path=path)
            problem = Problem(code=code, severity="error", where=where, message=message)
            self.problems.found.append(problem)

    # The graph

    def read(self, file: dict[str, Json]) -> Tree:
        """Read the file, and return its graph, the problems in it, the run states of the graph and
        its actions, and remarks. No file makes it fail: a value that does not fit is stored in
        `extra` or reported."""
        extra: Extra = []
        if "graph_name" not in file:
            self.report("graph-name-missing", "", "The graph has no name; the engine refuses it.")
        name = text_of(file, "graph_name", extra)
        description = text_of(file, "graph_description", extra)
        ours, rest = graph_attributes(file)
        if rest is not None:
            extra.append(("gui_attributes", rest))
        notes = ours.get("notes")
        self._read_actions(file, extra)
        entries = self._end(file, "graph_entry", extra, self._child)
        exits = self._end(file, "graph_exit", extra, self._parent)
        extra.extend((key, dump(value)) for key, value in file.items() if key not in _GRAPH_FIELDS)
        graph_state = self._state(file, "graph_state", "")
        relations = self._relations(entries, exits)
        graph = Graph(
            name=name,
            description=description,
            actions=tuple(self.actions),
            relations=tuple(relations),
            entry_position=position_of(ours.get("entry")),
            exit_position=position_of(ours.get("exit")),
            direction=direction_of(ours.get("direction")),
            notes=tuple((k, dump(v)) for k, v in notes.items()) if isinstance(notes, dict) else (),
            extra=tuple(extra),
        )
        return Tree(
            with_waypoints(graph, ours.get("waypoints")),
            tuple(self.problems.found),
            self.states,
            graph_state,
            self.notes.all(),
            self.origins,
        )

    def _state(self, item: dict[str, Json], field: str, path: str) -> str | None:
        """Return the run state in this field of a graph or action, or None if it is missing,
        UNINITIALIZED or wrong. A wrong state is reported: the engine refuses the file. `path`: the
        JSON pointer of the item."""
        if field not in item:
            return None
        value = item[field]
        known = NODE_STATES if field == "state" else GRAPH_STATES
        if not isinstance(value, str) or value not in known:
            message = f"{dump(value)} is not a state that the engine knows; it refuses the file."
            self.report("state-illegal", f"{path}/{field}", message)
            return None
        self.notes.add(f"“{field}” was left out; it says how a past run stood.", f"{path}/{field}")
        return None if value == "UNINITIALIZED" else value

    def _end(self, file: dict[str, Json], field: str, extra: Extra, kind: _Kind) -> list[_Item]:
        if field not in file:
            if len(self.actions) == 1 and not file.keys() & {"graph_entry", "graph_exit"}:
                only = self.actions[0]
                self.origins[pointer(field, 0)] = self._origin(pointer("actions", 0))
                return [_Item(-1, only.name, only.instance_id, _Side(0.0))]
            message = f"The file has no {field}; the engine refuses it."
            self.report("entry-exit-missing", "", message)
            return []
        value = file[field]
        if not isinstance(value, list):
            extra.append((field, dump(value)))
            return []
        return self._items(-1, value, pointer(field), pointer(field), kind)

    def _origin(self, path: str) -> str:
        return self.origins.get(path, path)

    def _came_from(self, canonical: str, path: str) -> None:
        """Record that the value at the pointer `canonical` of the canonical text is at `path` in
        the file, if that differs."""
        if canonical != path:
            self.origins[canonical] = path

    # Actions

    def _read_actions(self, file: dict[str, Json], extra: Extra) -> None:
        value = file.get("actions", [])
        if not isinstance(value, list):
            extra.append(("actions", dump(value)))
            return
        used: set[str] = set()
        for index, item in enumerate(value):
            path = pointer("actions", index)
            if isinstance(item, dict):
                self._read_action(item, path, used)
            else:
                self.report("action-illegal", path, "This is not an action and was left out.")

    def _read_action(self, item: dict[str, Json], path: str, used: set[str]) -> None:
        extra: Extra = []
        index = len(self.actions)
        self._came_from(pointer("actions", index), path)
        position, key, asks, rest = action_attributes(item)
        if rest is not None:
            extra.append(("gui_attributes", rest))
        if key is None or key in used:
            key = f"a{index + 1}"
        used.add(key)
        if "type" not in item:
            message = "The action has no type; the engine refuses the file. It is read as sync."
            self.report("type-missing", path, message)
        name = text_of(item, "name", extra)
        instance_id = number_of(item, extra)
        twins = self.by_name.setdefault((name, instance_id), [])
        action = Action(
            key=key,
            name=name,
            instance_id=instance_id,
            type=text_of(item, "type", extra, "sync"),
            actor=text_of(item, "actor", extra),
            description=text_of(item, "description", extra),
            inputs=parameters_of(item, "input_parameters", extra),
            outputs=parameters_of(item, "output_parameters", extra),
            position=position,
            twin=bool(twins),
            asks=asks,
        )
        twins.append(index)
        self._read_run_state(item, key, path)
        self._read_relations(item, path, index, extra)
        extra.extend((field, dump(item[field])) for field in item if field not in _ACTION_FIELDS)
        self.actions.append(msgspec.structs.replace(action, extra=tuple(extra)))

    def _read_run_state(self, item: dict[str, Json], key: Key, path: str) -> None:
        if state := self._state(item, "state", path):
            self.states[key] = state
        if "runtime" in item and not is_runtime(item["runtime"]):
            message = "The run log of the action is malformed; the engine refuses the file."
            self.report("runtime-illegal", path + "/runtime", message)
        elif "runtime" in item:
            self.notes.add(
                "“runtime” was left out; it is the log of a past run.", path + "/runtime"
            )

    # Relations

    def _read_relations(self, item: dict[str, Json], path: str, index: int, extra: Extra) -> None:
        place = pointer("actions", index)
        for field, lists, kind in (
            ("parents", self.listed, self._parent),
            ("children", self.listing, self._child),
        ):
            items: list[_Item] = []
            if isinstance(value := item.get(field, []), list):
                items = self._items(index, value, f"{path}/{field}", f"{place}/{field}", kind)
            else:
                extra.append((field, dump(value)))
            lists.append(items)

    def _items(
        self, owner: int, items: list[Json], path: str, place: str, kind: _Kind
    ) -> list[_Item]:
        """Read a list of relations. `owner`: the index of the action that has it, negative for an
        end of the graph; `path`: its pointer in the file; `place`: its pointer in the canonical
        text; `kind`: reads one side of a relation."""
        found: list[_Item] = []
        for index, item in enumerate(items):
            if not isinstance(item, dict) or not isinstance(item.get("name"), str):
                message = "This relation names no action; the engine refuses it. It was left out."
                self.report("relation-unnamed", path + pointer(index), message)
                continue
            extra: Extra = []
            self._came_from(place + pointer(len(found)), path + pointer(index))
            name = str(item["name"])
            found.append(_Item(owner, name, number_of(item, extra), kind(index, item, extra)))
        return found

    @staticmethod
    def _parent(order: int, item: dict[str, Json], extra: Extra) -> _Side:
        conditions, fits = conditions_of(item.get("conditions", []))
        if not fits:
            extra.append(("conditions", dump(item["conditions"])))
        required = item.get("required", True)
        if not isinstance(required, bool):
            extra.append(("required", dump(required)))
            required = True
        known = {"name", "instance_id", "required", "conditions"}
        extra.extend((field, dump(item[field])) for field in item if field not in known)
        return _Side(float(order), conditions, required, (), tuple(extra))

    @staticmethod
    def _child(order: int, item: dict[str, Json], extra: Extra) -> _Side:
        remap, fits, plain = remap_of(item.get("remap", []))
        if not (fits and plain):
            extra.append(("remap", dump(item["remap"])))
        known = {"name", "instance_id", "remap"}
        extra.extend((field, dump(item[field])) for field in item if field not in known)
        return _Side(float(order), remap=remap, extra=tuple(extra))

    def _relations(self, entries: list[_Item], exits: list[_Item]) -> list[Relation]:
        relations = self._ends(entries, exits)
        parents: dict[tuple[int, int, int], _Side] = {}
        children: dict[tuple[int, int, int], _Side] = {}
        count: Counter[tuple[int, int]] = Counter()
        listing = self._who_lists(self.listing)
        for item in chain.from_iterable(self.listed):
            parent = self._find(item, listing)
            parents[parent, item.owner, count[parent, item.owner]] = item.side
            count[parent, item.owner] += 1
        count.clear()
        listed = self._who_lists(self.listed)
        for item in chain.from_iterable(self.listing):
            child = self._find(item, listed)
            children[item.owner, child, count[item.owner, child]] = item.side
            count[item.owner, child] += 1
        for place in parents | children:
            relations.append(self._joined(place, parents.get(place), children.get(place)))
        return relations

    def _who_lists(self, sides: list[list[_Item]]) -> dict[tuple[_Name, _Name], int]:
        """Return, for each pair of an action's name and a name that it lists, the index of the
        first action of that name that lists it."""
        found: dict[tuple[_Name, _Name], int] = {}
        for item in chain.from_iterable(sides):
            owner = self.actions[item.owner]
            place = (owner.name, owner.instance_id), (item.name, item.instance_id)
            found.setdefault(place, item.owner)
        return found

    def _joined(
        self, place: tuple[int, int, int], parent: _Side | None, child: _Side | None
    ) -> Relation:
        return Relation(
            parent=self.actions[place[0]].key,
            child=self.actions[place[1]].key,
            listing=place[2],
            conditions=parent.conditions if parent else ENGINE_DEFAULTS,
            required=parent.required if parent else True,
            remap=child.remap if child else (),
            only="parents" if child is None else "children" if parent is None else None,
            parent_order=child.order if child else 0.0,
            child_order=parent.order if parent else 0.0,
            parents_extra=parent.extra if parent else (),
            children_extra=child.extra if child else (),
        )

    def _ends(self, entries: list[_Item], exits: list[_Item]) -> list[Relation]:
        relations: list[Relation] = []
        count: Counter[tuple[Key, Key]] = Counter()
        for item in entries:
            child = self.actions[self._find(item, {})].key
            relations.append(
                Relation(
                    parent=ENTRY,
                    child=child,
                    listing=count[ENTRY, child],
                    conditions=ENTRY_CONDITIONS,
                    remap=item.side.remap,
                    parent_order=item.side.order,
                    children_extra=item.side.extra,
                )
            )
            count[ENTRY, child] += 1
        for item in exits:
            parent = self.actions[self._find(item, {})].key
            relations.append(
                Relation(
                    parent=parent,
                    child=EXIT,
                    listing=count[parent, EXIT],
                    conditions=item.side.conditions,
                    required=item.side.required,
                    child_order=item.side.order,
                    parents_extra=item.side.extra,
                )
            )
            count[parent, EXIT] += 1
        return relations

    def _find(self, item: _Item, back: dict[tuple[_Name, _Name], int]) -> int:
        """Return the index of the action that an item names: of several with this name, the one
        that also lists the owner (`back`: as `_who_lists` returns), else the first. If no action
        has the name, a missing one (ghost) is added."""
        name = item.name, item.instance_id
        found = self.by_name.get(name)
        if found is None:
            found = self.by_name[name] = [len(self.actions)]
            key = f"g{len(self.actions) + 1}"
            self.actions.append(Action(key=key, name=name[0], instance_id=name[1], missing=True))
        if len(found) > 1 and item.owner >= 0:
            owner = self.actions[item.owner]
            return back.get((name, (owner.name, owner.instance_id)), found[0])
        return found[0]
