"""Fixes of problems. Each is one call, idempotent, and invents no meaning."""

from collections.abc import Callable, Iterable, Mapping
from typing import Final

import msgspec

from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.model import Action, Graph, Key, Parameter, Problem, Relation
from action_assistant.umrf.parameters import with_example
from action_assistant.umrf.relations import MAX_REFERRED_ID


def fix(graph: Graph, problem: Problem) -> Graph:
    """Return the graph after the fix that `problem.fix` names. The graph is returned unchanged if
    the problem has no fix, or the fix was applied already."""
    mend = _FIXES.get(problem.fix or "")
    return mend(graph, problem) if mend else graph


def _mend_relation(change: Callable[[Relation], Relation | None]) -> "_Fix":
    """Return a fix that replaces the problem's relation by the result of `change`, or removes the
    relation if that returns None."""

    def mend(graph: Graph, problem: Problem) -> Graph:
        relations = (
            change(relation) if _names(relation) == problem.where.relation else relation
            for relation in graph.relations
        )
        return _without_lonely_ghosts(
            msgspec.structs.replace(graph, relations=tuple(r for r in relations if r is not None))
        )

    return mend


def _names(relation: Relation) -> str:
    listing = f";{relation.listing}" if relation.listing else ""
    return f"{relation.parent}>{relation.child}{listing}"


def _mirrored(relation: Relation) -> Relation:
    return msgspec.structs.replace(relation, only=None)


def _not_required(relation: Relation) -> Relation:
    return msgspec.structs.replace(relation, required=False)


def _without_lonely_ghosts(graph: Graph) -> Graph:
    named = {key for r in graph.relations for key in (r.parent, r.child)}
    actions = tuple(a for a in graph.actions if not a.missing or a.key in named)
    return msgspec.structs.replace(graph, actions=actions)


def _renumbered(graph: Graph, problem: Problem) -> Graph:
    """Return the graph in which the problem's action has the lowest `instance_id` that no other
    action of its name has; unchanged if its number is free already."""
    used: Mapping[Key, Action] = {action.key: action for action in graph.actions}
    action = used.get(problem.where.aid or "")
    if action is None:
        return graph
    taken = {a.instance_id for a in graph.actions if a.name == action.name and a is not action}
    reserved = {0} if action.name in ("graph_entry", "graph_exit") else set()
    if action.instance_id not in taken | reserved and action.instance_id <= MAX_REFERRED_ID:
        return graph
    free = next(n for n in range(len(taken) + 2) if n not in taken | reserved)
    extra = tuple((field, text) for field, text in action.extra if field != "instance_id")
    return _with_action(
        graph, msgspec.structs.replace(action, instance_id=free, twin=False, extra=extra)
    )


def _typed(graph: Graph, problem: Problem) -> Graph:
    for action in graph.actions:
        if action.key == problem.where.aid and not action.type:
            return _with_action(graph, msgspec.structs.replace(action, type="sync"))
    return graph


def _optional_outputs(graph: Graph, problem: Problem) -> Graph:
    for action in graph.actions:
        if action.key == problem.where.aid:
            return _with_action(graph, with_optional_outputs(action))
    return graph


def with_optional_outputs(action: Action) -> Action:
    """Return the action in which all outputs without a value are optional (`pvf_required` is
    false)."""
    outputs = tuple(_optional(parameter) for parameter in action.outputs)
    return msgspec.structs.replace(action, outputs=outputs)


def _optional(parameter: Parameter) -> Parameter:
    """Return a parameter without a value as an optional one; any other parameter unchanged."""
    value = parse_small(parameter.text)
    if not isinstance(value, dict) or "pvf_type" not in value or "pvf_value" in value:
        return parameter
    if value.get("pvf_required") is False:
        return parameter
    return Parameter(parameter.path, dump({**value, "pvf_required": False}))


def _with_example(graph: Graph, problem: Problem) -> Graph:
    """Return the graph in which the input that the problem is about has its declared example as
    value, if the example fits."""
    _, found, path = problem.where.path.partition("/input_parameters/")
    for action in graph.actions:
        if found and action.key == problem.where.aid:
            inputs = tuple(with_example(p) if p.path == path else p for p in action.inputs)
            return _with_action(graph, msgspec.structs.replace(action, inputs=inputs))
    return graph


def with_examples(graph: Graph, problems: Iterable[Problem]) -> Graph:
    """Return the graph in which every input that a problem with the fix `take-example` is about has
    its example as value."""
    for problem in problems:
        if problem.fix == "take-example":
            graph = _with_example(graph, problem)
    return graph


def _with_action(graph: Graph, changed: Action) -> Graph:
    actions = tuple(changed if a.key == changed.key else a for a in graph.actions)
    return msgspec.structs.replace(graph, actions=actions)


_Fix = Callable[[Graph, Problem], Graph]

_FIXES: Final[dict[str, _Fix]] = {
    "mirror-relation": _mend_relation(_mirrored),
    "not-required": _mend_relation(_not_required),
    "outputs-optional": _optional_outputs,
    "remove-relation": _mend_relation(lambda _: None),
    "renumber": _renumbered,
    "take-example": _with_example,
    "type-sync": _typed,
}
