"""Sorts problems as the page shows them: errors to mend, and values that are not written yet.

Twin of `frontend/src/graph/problems`, which shows them one by one; lists of graphs have the same
two numbers. `tests/vectors/problem-kinds.json` holds both to it.
"""

import re
from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.codes import QUIET
from action_assistant.umrf.json.text import Json, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Parameter,
    Problem,
    Relation,
)
from action_assistant.umrf.parameters import flat_name, keys_of
from action_assistant.umrf.semantics.values import RemapUnknown, renamed

#: `wrong`: certain harm, or a mistake. `fill-in`: still to be written. `warning`: may go wrong. `note`: applies to
#: nearly every graph on this engine.
ProblemKind: TypeAlias = Literal["wrong", "fill-in", "warning", "note"]

#: Codes of things that have not been written or connected so far.
UNWRITTEN: Final = frozenset(
    {
        "empty",
        "graph-name-empty",
        "graph-name-missing",
        "name-empty",
        "no-entry",
        "no-exit",
        "type-empty",
        "type-missing",
        "unreachable",
    }
)
#: Mistakes that no engine notices, so that checks call them warnings.
MISTAKES: Final = frozenset({"parameter-allowed", "parameter-inside", "remap-target", "wrong-side"})

_INPUT: Final = re.compile(r"/actions/[0-9]+/input_parameters/(.+)", re.DOTALL)
_LETTERS: Final = frozenset({"x", "y", "z", "w", "r", "p", "roll", "pitch", "yaw", "theta"})
_POSE_PARTS: Final = frozenset(
    {"position", "orientation", "rotation", "translation", "linear", "angular"}
)
_MOST_IN_ROW: Final = 4


class ProblemCounts(msgspec.Struct, frozen=True):
    """The number of mistakes in a graph (`wrong`), and the number of places that still have to be
    filled in."""

    wrong: int
    to_fill_in: int


def problem_counts(problems: Iterable[Problem], graph: Graph) -> ProblemCounts:
    """Count the mistakes of a graph and the places to fill in, as the page shows them: a pose,
    point or vector counts once, however many of its numbers have a problem."""
    actions = {action.key: action for action in graph.actions}
    arrows: dict[Key, list[Relation]] = {}
    for relation in filter(_hands_over, graph.relations):
        arrows.setdefault(relation.child, []).append(relation)
    misfits: dict[Key, frozenset[str]] = {}
    rows: dict[Key, tuple[str, ...]] = {}
    counted: dict[ProblemKind, set[tuple[str, str, str]]] = {
        "wrong": set(), "fill-in": set(), "warning": set(), "note": set(),
    }  # fmt: skip
    for problem in problems:
        path, what = input_of(problem), problem.message
        action = None if path is None else actions.get(problem.where.aid or "")
        if action is not None and action.key not in misfits:
            misfits[action.key] = _misfits(action, arrows.get(action.key, ()), actions)
            rows[action.key] = tuple(_rows(action.inputs))
        misfit = action is not None and path in misfits[action.key]
        kind = kind_of(problem, misfit=misfit)
        if path is not None and kind == "fill-in":
            starts = () if action is None else rows[action.key]
            what = "in/" + next((row[:-1] for row in starts if path.startswith(row)), path)
        place = problem.where.relation or problem.where.aid or ""
        counted[kind].add((problem.code, place, what))
    return ProblemCounts(len(counted["wrong"]), len(counted["fill-in"]))


def input_of(problem: Problem) -> str | None:
    """Return the path of the input for which this problem asks a value; None if the problem is of
    another kind."""
    found = _INPUT.fullmatch(problem.where.path) if problem.code in {"H7", "H8"} else None
    return None if found is None else found[1]


def kind_of(problem: Problem, *, misfit: bool = False) -> ProblemKind:
    """Return the kind of a problem. `misfit`: the input that lacks a value only gets values by
    arrows that it cannot take, so that the problem is a mistake."""
    if input_of(problem) is not None:
        return "wrong" if misfit else "fill-in"
    if problem.code in UNWRITTEN:
        return "fill-in"
    if problem.severity == "error" or problem.code in MISTAKES:
        return "wrong"
    return "note" if problem.code in QUIET else "warning"


def _misfits(
    action: Action, arrows: Iterable[Relation], actions: Mapping[Key, Action]
) -> frozenset[str]:
    """Return the paths of inputs of an action to which arrows bring values, but none that the input
    can take."""
    inputs = {flat_name(each.path): each for each in action.inputs}
    taken: dict[str, bool] = {}
    for relation in arrows:
        parent = actions.get(relation.parent)
        if parent is None or parent.missing:
            continue
        outputs = {flat_name(each.path): each for each in parent.outputs}
        try:
            reached = renamed(outputs, relation.remap, inputs)
        except RemapUnknown:
            continue
        for name, output in reached.items():
            target = inputs[name]
            taken[target.path] = taken.get(target.path, False) or _takes(target, outputs[output])
    return frozenset(path for path, fits in taken.items() if not fits)


def _hands_over(relation: Relation) -> bool:
    """Return whether an arrow hands its parent's outputs over: it responds to some outcome other
    than by a bypass."""
    if relation.only is not None or relation.listing or relation.parent == ENTRY:
        return False
    return any(relation.conditions.answer(o) not in {"ignore", "bypass"} for o in PRECONDITIONS)


def _takes(target: Parameter, source: Parameter) -> bool:
    """Return whether an input (`target`) accepts the value of an output (`source`): the types are
    equal and the input is not locked."""
    to, given = _leaf(target), _leaf(source)
    return _type(to) == _type(given) and to.get("pvf_updatable") is not False


def _rows(inputs: Iterable[Parameter]) -> Iterable[str]:
    """Yield the path prefix of each point, vector and pose among the inputs, which people see as
    one thing: `grip/` for `grip/position/x`."""
    for prefix, neighbours in groupby(inputs, key=lambda each: _above(each.path)):
        members = list(neighbours)
        if not prefix or not 2 <= len(members) <= _MOST_IN_ROW or not all(map(_axis, members)):
            continue
        owner = prefix[:-1]
        in_pose = "/" in owner and keys_of(owner)[-1] in _POSE_PARTS
        yield _above(owner) if in_pose else prefix


def _above(path: str) -> str:
    return path[: path.rfind("/") + 1]


def _axis(parameter: Parameter) -> bool:
    """Return whether a parameter is a number without allowed values whose name is that of an axis,
    such as `x`."""
    leaf = _leaf(parameter)
    free = not isinstance(allowed := leaf.get("pvf_allowed_values"), list) or not allowed
    return keys_of(parameter.path)[-1] in _LETTERS and _type(leaf) == "number" and free


def _leaf(parameter: Parameter) -> dict[str, Json]:
    leaf = parse_small(parameter.text)
    return leaf if isinstance(leaf, dict) else {}


def _type(leaf: dict[str, Json]) -> str | None:
    kind = leaf.get("pvf_type")
    return kind if isinstance(kind, str) else None
