"""Computes the graph that an engine gives back, so that the sent graph can be compared with the one
that is seen.

See docs/umrf-and-the-engine.md 1.4.
"""

from collections.abc import Mapping

import msgspec

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import (
    ENGINE_DEFAULTS,
    ENTRY,
    EXIT,
    Action,
    Graph,
    Key,
    Parameter,
    Relation,
)
from action_assistant.umrf.parameters import escape, flat_name


def echo(graph: Graph, facts: EngineFacts) -> Graph:
    """Return a graph as an engine gives it back in feedback and get answers (its echo), so that the
    `digest` of both can be compared. Missing in it are the graph's description, unknown fields,
    exit conditions, renamings of the entry, `pvf_required`, the order of actions, values of
    outputs, and values of inputs that a parent may hand over. `facts`, the engine build, makes no
    difference so far."""
    del facts  # all measured builds give the same back
    real = sorted((a for a in graph.actions if not a.missing), key=lambda a: a.full_name)
    reached = _reached(graph, {action.key: action for action in real})
    return Graph(
        name=graph.name,
        actions=tuple(_action(action, reached.get(action.key, set())) for action in real),
        relations=tuple(map(_relation, graph.relations)),
    )


def _reached(graph: Graph, actions: Mapping[Key, Action]) -> dict[Key, set[str]]:
    """Return, by key of the action, the flat names of the inputs that an output of some parent may
    reach. `actions`: all by key."""
    found: dict[Key, set[str]] = {}
    for relation in graph.relations:
        parent = actions.get(relation.parent)
        if parent is None or relation.child not in actions:
            continue
        renamed = {remap.source: remap.target for remap in relation.remap}
        names = {flat_name(parameter.path) for parameter in parent.outputs}
        found.setdefault(relation.child, set()).update(renamed.get(name, name) for name in names)
    return found


def _action(action: Action, reached: set[str]) -> Action:
    return Action(
        key=action.key,
        name=action.name,
        instance_id=action.instance_id,
        type=action.type,
        actor=action.actor,
        description=action.description,
        inputs=_parameters(action.inputs, reached),
        outputs=_parameters(action.outputs, None),
    )


def _parameters(
    parameters: tuple[Parameter, ...], reached: set[str] | None
) -> tuple[Parameter, ...]:
    """Return parameters as the engine prints them. Parameters whose flat name is in `reached`
    (None: all) have no value, since an output of a parent may set it."""
    found: dict[str, Parameter] = {}
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if not isinstance(leaf, dict) or "pvf_type" not in leaf:
            continue
        name = flat_name(parameter.path)
        path = "/".join(escape(key) for key in name.split("::"))
        printed: dict[str, Json] = {"pvf_type": leaf["pvf_type"]}
        if "pvf_value" in leaf and reached is not None and name not in reached:
            printed["pvf_value"] = leaf["pvf_value"]
        if leaf.get("pvf_updatable") is False:
            printed["pvf_updatable"] = False
        allowed = leaf.get("pvf_allowed_values")
        if allowed is not None and allowed != []:
            printed["pvf_allowed_values"] = allowed if isinstance(allowed, list) else [allowed]
        found.setdefault(name, Parameter(path, dump(printed)))
    return tuple(found.values())


def _relation(relation: Relation) -> Relation:
    plain = msgspec.structs.replace(relation, parents_extra=(), children_extra=())
    if relation.parent == ENTRY:
        return msgspec.structs.replace(plain, remap=())
    if relation.child == EXIT:
        return msgspec.structs.replace(plain, conditions=ENGINE_DEFAULTS)
    remap = tuple(sorted(relation.remap, key=lambda remap: remap.source))
    return msgspec.structs.replace(plain, remap=remap)
