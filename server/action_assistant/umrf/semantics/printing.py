"""Prints a running graph as the engine prints it in feedback and in answers to a get.

See docs/umrf-and-the-engine.md 1 and 4.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from action_assistant.umrf.model import Action
from action_assistant.umrf.semantics.parts import ENTRY_NODE, Edge, Node, NodeLink, Running
from action_assistant.umrf.semantics.script import DEFAULT
from action_assistant.umrf.semantics.values import Slot

#: The order in which the engine lists conditions.
_LISTED: Final = ("on_true", "on_false", "on_stopped", "on_error")
_MARGIN: Final = "\n" + 8 * " "  # before each line of an action inside its graph


class GraphPrinter:
    """Prints one running graph after every change; the text of an action that did not change is
    reused.

    `attributes`: the `gui_attributes` of actions by full name, which the engine gives back
    verbatim. The engine drops the description of running graphs (unless `described`), and the
    conditions of exits and the renamings of entries (unless `conditioned`).

    See docs/umrf-and-the-engine.md 1.4.
    """

    def __init__(
        self,
        running: Running,
        attributes: Mapping[str, Any],
        *,
        described: bool = False,
        conditioned: bool = False,
    ) -> None:
        self._running = running
        self._attributes = attributes
        self._described = {a.key: a.description for a in running.graph.actions}
        self._nodes = [running.nodes[name] for name in sorted(running.nodes)]
        self._printed: dict[str, tuple[object, str]] = {}
        entry = [_child(edge.label, _renamed(edge, conditioned)) for edge in running.entry.children]
        exits = [_parent(name, link, conditioned) for name, link in running.exit.links.items()]
        description = running.graph.description if described else ""
        self._end = (
            f',\n    "graph_description": {json.dumps(description, ensure_ascii=False)}'
            f',\n    "graph_entry": {_text(entry, _MARGIN[:5])}'
            f',\n    "graph_exit": {_text(exits, _MARGIN[:5])}'
            f',\n    "graph_name": {json.dumps(running.name, ensure_ascii=False)}'
        )

    def text(
        self,
        graph_state: str,
        states: Mapping[str, str],
        messages: Mapping[str, Sequence[tuple[int, str]]],
    ) -> str:
        """Return the text of the graph as the engine prints it, in this state and with these states
        of its actions, by full name. `messages`: the messages of each action as (ms since 1970,
        text)."""
        actions = ",".join(
            self._action(
                node, states.get(node.full_name, "UNINITIALIZED"), messages.get(node.full_name, ())
            )
            for node in self._nodes
        )
        body = f"[{actions}\n    ]" if self._nodes else "[]"
        shown = "INITIALIZED" if graph_state == "UNINITIALIZED" else graph_state
        return f'{{\n    "actions": {body}{self._end},\n    "graph_state": "{shown}"\n}}'

    def _action(self, node: Node, state: str, messages: Sequence[tuple[int, str]]) -> str:
        values = [slot.value for slot in node.inputs.values()]
        key = (state, tuple(messages), values)
        known = self._printed.get(node.full_name)
        if known is not None and known[0] == key:
            return known[1]
        text = _MARGIN + _text(self._fields(node, state, messages), _MARGIN)
        self._printed[node.full_name] = (key, text)
        return text

    def _fields(
        self, node: Node, state: str, messages: Sequence[tuple[int, str]]
    ) -> dict[str, Any]:
        fields = _own_fields(node, self._described.get(node.key, ""), state)
        if node.full_name in self._attributes:
            fields["gui_attributes"] = self._attributes[node.full_name]
        parents = [(name, link) for name, link in node.links.items() if name != ENTRY_NODE]
        if parents:
            fields["parents"] = [_parent(name, link, True) for name, link in parents]
        children = [e for e in node.children if e.child is not self._running.exit]
        if children:
            fields["children"] = [_child(edge.label, _renamed(edge, True)) for edge in children]
        if messages:
            printed = [{"message": text, "timestamp": at} for at, text in messages]
            fields["runtime"] = {"messages": printed}
        return fields


def printed_action(action: Action) -> str:
    """Return the JSON text by which an engine lists an action that it has in its index."""
    node = Node(action, action.full_name, (DEFAULT,))
    return _text(_own_fields(node, action.description, "UNINITIALIZED"), "\n")


def _own_fields(node: Node, description: str, state: str) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "name": node.name,
        "instance_id": node.instance_id,
        "type": node.type,
        "description": description,
        "state": state,
    }
    if node.actor:
        fields["actor"] = node.actor
    if node.inputs:
        fields["input_parameters"] = _parameters(node.inputs, values=True)
    if node.outputs:
        fields["output_parameters"] = _parameters(node.outputs, values=False)
    return fields


def _text(value: Any, margin: str) -> str:
    return json.dumps(value, indent=4, sort_keys=True, ensure_ascii=False).replace("\n", margin)


def _name(full_name: str) -> dict[str, Any]:
    name, _, number = full_name.rpartition("_")
    return {"name": name, "instance_id": int(number)}


def _parent(full_name: str, link: NodeLink, with_conditions: bool) -> dict[str, Any]:
    fields = _name(full_name) | {"required": link.required}
    if with_conditions:
        conditions = link.conditions
        fields["conditions"] = [
            f"{outcome} -> {getattr(conditions, outcome)}" for outcome in _LISTED
        ]
    return fields


def _renamed(edge: Edge, with_remap: bool) -> list[dict[str, str]]:
    remap = sorted(edge.remap, key=lambda each: each.source) if with_remap else ()
    return [{"from": each.source, "to": each.target} for each in remap]


def _child(label: str, remap: list[dict[str, str]]) -> dict[str, Any]:
    return _name(label.partition(" => ")[2]) | ({"remap": remap} if remap else {})


def _parameters(slots: Mapping[str, Slot], *, values: bool) -> dict[str, Any]:
    """Return parameters as nested JSON values, by the `::` in their names. `values`: write the
    value of each that holds one; the engine does so for inputs only."""
    root: dict[str, Any] = {}
    for flat, slot in slots.items():
        leaf: dict[str, Any] = {"pvf_type": slot.type}
        if values and slot.has_value():
            leaf["pvf_value"] = slot.value
        if not slot.updatable:
            leaf["pvf_updatable"] = False
        if slot.allowed:
            leaf["pvf_allowed_values"] = slot.allowed
        *groups, last = flat.split("::")
        group = root
        for name in groups:
            inner = group.setdefault(name, {})
            group = inner if isinstance(inner, dict) else {}
        group[last] = leaf
    return root
