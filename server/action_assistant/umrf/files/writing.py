"""Writes graphs as canonical D3 files, and names those files (docs/contracts.md 2)."""

import re
from collections.abc import Iterable
from operator import attrgetter
from typing import Final

import msgspec

from action_assistant.umrf.files.fields import ASKS
from action_assistant.umrf.files.waypoints import waypoints_json
from action_assistant.umrf.json.text import Json, Number, dump_indented, number, parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Key, Position, Relation
from action_assistant.umrf.parameters import nest
from action_assistant.umrf.relations import conditions_text

#: An engine takes a file with this in its name for a graph, and one with the other for an action.
GRAPH_MARK: Final = "graph.json"
ACTION_MARK: Final = "umrf.json"
ENDING: Final = ".umrf.graph.json"
_UNFIT: Final = re.compile(r"[^A-Za-z0-9_.-]+")
_LONGEST_STEM: Final = 80


class Stamp(msgspec.Struct, frozen=True):
    """The ids of the graph, version and run to which a file belongs."""

    graph: str | None = None
    version: str | None = None
    run: str | None = None


def write(graph: Graph, stamp: Stamp | None = None) -> str:
    """Return the canonical text of a graph's file; every graph can be written. `stamp`: ids of
    graph, version and run to write into it, None for none."""
    return dump_indented(tree_of(graph, stamp)) + "\n"


def tree_of(graph: Graph, stamp: Stamp | None = None) -> dict[str, Json]:
    """Return the canonical file of a graph as nested JSON values. `stamp`: the ids of graph,
    version and run that the file carries, None for none."""
    return _Writer(graph, stamp).graph()


def name_order(relation: Relation) -> tuple[str, int]:
    """Return the key by which relations with the same order number are sorted: the keys of parent
    and child, then the number of the listing."""
    return f"{relation.parent}>{relation.child}", relation.listing


class _Writer:
    def __init__(self, graph: Graph, stamp: Stamp | None) -> None:
        self.source = graph
        self.stamp = stamp
        self.actions: dict[Key, Action] = {action.key: action for action in graph.actions}
        self.parents: dict[Key, list[Relation]] = {}
        self.children: dict[Key, list[Relation]] = {}
        ordered = sorted(graph.relations, key=name_order)
        for relation in sorted(ordered, key=attrgetter("child_order")):
            if relation.only != "children" and self._exists(relation.parent):
                self.parents.setdefault(relation.child, []).append(relation)
        for relation in sorted(ordered, key=attrgetter("parent_order")):
            if relation.only != "parents" and self._exists(relation.child):
                self.children.setdefault(relation.parent, []).append(relation)

    def _exists(self, key: Key) -> bool:
        """Return whether a file can name this end of a relation: the action exists."""
        return key in self.actions

    def graph(self) -> dict[str, Json]:
        """Return the whole file as a JSON object."""
        graph = self.source
        fields: dict[str, Json] = {"graph_name": graph.name}
        if graph.description:
            fields["graph_description"] = graph.description
        entries = self.children.get(ENTRY, [])
        exits = self.parents.get(EXIT, [])
        fields["graph_entry"] = [self._child(r) for r in entries]
        fields["graph_exit"] = [self._parent(r) for r in exits]
        fields["actions"] = [self._action(a) for a in graph.actions if not a.missing]
        ours = self._graph_attributes()
        return _with_extra(fields, graph.extra, {"action_assistant": ours} if ours else {})

    def _graph_attributes(self) -> dict[str, Json]:
        graph, stamp = self.source, self.stamp
        ours: dict[str, Json] = {}
        if stamp is not None:
            named = {"graph": stamp.graph, "version": stamp.version, "run": stamp.run}
            ours.update({key: value for key, value in named.items() if value is not None})
        if graph.entry_position is not None:
            ours["entry"] = _point(graph.entry_position)
        if graph.exit_position is not None:
            ours["exit"] = _point(graph.exit_position)
        if graph.direction != "down":
            ours["direction"] = graph.direction
        if graph.notes:
            ours["notes"] = {key: parse_small(text) for key, text in graph.notes}
        if waypoints := waypoints_json(graph):
            ours["waypoints"] = waypoints
        return ours

    def _action(self, action: Action) -> dict[str, Json]:
        fields: dict[str, Json] = {"name": action.name}
        fields["instance_id"] = Number(str(action.instance_id))
        fields["type"] = action.type
        if action.actor:
            fields["actor"] = action.actor
        if action.description:
            fields["description"] = action.description
        if action.inputs:
            fields["input_parameters"] = nest(action.inputs)
        if action.outputs:
            fields["output_parameters"] = nest(action.outputs)
        if parents := self.parents.get(action.key):
            fields["parents"] = [self._parent(r) for r in parents]
        if children := self.children.get(action.key):
            fields["children"] = [self._child(r) for r in children]
        return _with_extra(fields, action.extra, self._action_attributes(action))

    def _action_attributes(self, action: Action) -> dict[str, Json]:
        ours: dict[str, Json] = {}
        if action.position is not None:
            ours["position"] = _point(action.position)
        if self.stamp is not None:
            named = {"aid": action.key, "version": self.stamp.version, "run": self.stamp.run}
            ours["action_assistant"] = {k: v for k, v in named.items() if v is not None}
        if action.asks:
            ours[ASKS] = {path: parse_small(mark) for path, mark in action.asks}
        return ours

    def _parent(self, relation: Relation) -> dict[str, Json]:
        fields = _reference(self.actions[relation.parent])
        fields["required"] = relation.required
        fields["conditions"] = conditions_text(relation.conditions)
        return _with_extra(fields, relation.parents_extra, {})

    def _child(self, relation: Relation) -> dict[str, Json]:
        fields = _reference(self.actions[relation.child])
        if relation.remap:
            fields["remap"] = [{"from": r.source, "to": r.target} for r in relation.remap]
        return _with_extra(fields, relation.children_extra, {})


def _reference(action: Action) -> dict[str, Json]:
    return {"name": action.name, "instance_id": Number(str(action.instance_id))}


def _point(position: Position) -> dict[str, Json]:
    return {"x": number(position[0]), "y": number(position[1])}


def _with_extra(
    fields: dict[str, Json], extra: Iterable[tuple[str, str]], attributes: dict[str, Json]
) -> dict[str, Json]:
    """Add the unknown fields in `extra` (name, JSON text), which take precedence, and this
    program's part of `gui_attributes` (`attributes`), and return the fields."""
    for field, text in extra:
        fields[field] = parse_small(text)
    if attributes:
        theirs = fields.pop("gui_attributes", None)
        joined = dict(theirs) if isinstance(theirs, dict) else {}
        for key, value in attributes.items():
            joined[key] = _joined(value, joined.get(key))
        fields["gui_attributes"] = joined
    return fields


def _joined(ours: Json, theirs: Json) -> Json:
    if isinstance(ours, dict) and isinstance(theirs, dict):
        return {**ours, **theirs, **ours}
    return ours


def graph_file_name(graph: str, number: int = 1) -> str:
    """Return a name that every file system accepts, whatever the graph is called.

    `number` distinguishes graphs that would have the same file name.
    """
    stem = unmarked(_UNFIT.sub("_", graph)).strip("._")[:_LONGEST_STEM] or "graph"
    return f"{stem}{'' if number == 1 else f'-{number}'}{ENDING}"


def unmarked(name: str) -> str:
    """Return a file name without the part (`.json`) by which an engine recognises files to read."""
    return name.replace(".json", "_json")
