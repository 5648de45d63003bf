"""Derives signatures from action files and graphs, for libraries.

See docs/umrf-and-the-engine.md 2.1.
"""

import msgspec

from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Parameter, Signature
from action_assistant.umrf.parameters import flat_name, without_value


def signature_of(action: Action) -> Signature:
    """Return the types of the parameters and outputs of `action`, as they stand in the action
    itself. No catalogue and no file is read."""
    inputs, optional = _types(action.inputs)
    outputs, _ = _types(action.outputs)
    return Signature(inputs=inputs, outputs=outputs, optional=optional)


def signature_of_graph(graph: Graph) -> Signature:
    """Return the inputs and outputs that a graph has as a sub-graph. Its inputs are the inputs of
    its entry actions that have no value. Its outputs are those of the last exit action that has any
    outputs."""
    by_key = {action.key: action for action in graph.actions if not action.missing}
    inputs: dict[str, str] = {}
    optional: frozenset[str] = frozenset()
    outputs: dict[str, str] = {}
    for relation in sorted(graph.relations, key=lambda r: r.child_order):
        if relation.parent == ENTRY and (entry := by_key.get(relation.child)):
            open_ = tuple(p for p in entry.inputs if not _has_value(parse_small(p.text)))
            types, free = _types(open_)
            inputs |= types
            optional |= free
        if relation.child == EXIT and (end := by_key.get(relation.parent)):
            outputs = _types(end.outputs)[0] or outputs
    return Signature(inputs=inputs, outputs=outputs, optional=optional)


def action_of_graph(graph: Graph) -> Action:
    """Return an action that stands for this graph in another graph, with the parameters of
    `signature_of_graph`. Its key is empty. An input that several entry actions have is required if
    any of them requires it."""
    by_key = {action.key: action for action in graph.actions if not action.missing}
    inputs: dict[str, Parameter] = {}
    outputs: tuple[Parameter, ...] = ()
    for relation in sorted(graph.relations, key=lambda r: r.child_order):
        if relation.parent == ENTRY and (entry := by_key.get(relation.child)):
            for parameter in entry.inputs:
                if _has_value(parse_small(parameter.text)):
                    continue
                known = inputs.get(parameter.path)
                if known is None or _types((known,))[1]:
                    inputs[parameter.path] = parameter
        if relation.child == EXIT and (end := by_key.get(relation.parent)):
            outputs = end.outputs or outputs
    return Action(
        key="",
        name=graph.name,
        description=graph.description,
        inputs=tuple(inputs.values()),
        outputs=tuple(map(without_value, outputs)),
    )


def with_inputs(graph: Graph) -> Graph:
    """Return the graph in which the entry actions require no input, as if a graph around it handed
    them the missing values."""
    entries = {relation.child for relation in graph.relations if relation.parent == ENTRY}
    actions = tuple(
        msgspec.structs.replace(action, inputs=tuple(map(_not_required, action.inputs)))
        if action.key in entries
        else action
        for action in graph.actions
    )
    return msgspec.structs.replace(graph, actions=actions)


def _has_value(leaf: Json) -> bool:
    return isinstance(leaf, dict) and "pvf_value" in leaf


def _not_required(parameter: Parameter) -> Parameter:
    leaf = parse_small(parameter.text)
    if not isinstance(leaf, dict) or "pvf_type" not in leaf or "pvf_value" in leaf:
        return parameter
    return Parameter(parameter.path, dump({**leaf, "pvf_required": False}))


def _types(parameters: tuple[Parameter, ...]) -> tuple[dict[str, str], frozenset[str]]:
    types: dict[str, str] = {}
    optional: set[str] = set()
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and isinstance(kind := leaf.get("pvf_type"), str):
            name = flat_name(parameter.path)
            types[name] = kind
            if leaf.get("pvf_required") is False:
                optional.add(name)
    return types, frozenset(optional)
