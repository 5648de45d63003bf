"""Updates the uses of a library action in a graph after the library has changed it.

A use keeps its values, its unknown fields and its name; its parameters become those of the library.
Values that an arrow handed over are still handed over after a renaming. Nothing is guessed: a
removed and an added parameter are the same only if the caller says so.
"""

from collections.abc import Iterable, Mapping
from typing import Final

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import Action, Graph, Key, Parameter, Relation, Remap
from action_assistant.umrf.parameters import NATIVE, fits, flat_name

#: The members of a library's parameter that matter to an engine, with the values that absent ones have.
_CONTRACT: Final[dict[str, Json]] = {
    "pvf_type": None,
    "pvf_required": True,
    "pvf_updatable": True,
    "pvf_locked": None,
    "pvf_allowed_values": None,
}
#: The members that a library defines, including those for people. All other members of a use are its own.
_DEFINED: Final = frozenset({*_CONTRACT, "pvf_example", "pvf_unit", "pvf_description"})


class Renames(msgspec.Struct, frozen=True):
    """The parameters that a library has renamed: pairs of the old path and the new path."""

    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]


NO_RENAMES: Final = Renames((), ())


def uses_of(graph: Graph, name: str) -> tuple[Action, ...]:
    """Return the actions of a graph that have the name of a library action."""
    return tuple(a for a in graph.actions if a.name == name and not a.missing)


def is_like(use: Action, known: Action) -> bool:
    """Return whether the action `use` of a graph has the parameters of the library action `known`,
    in any order and with any values."""
    return _shape(use.inputs) == _shape(known.inputs) and _shape(use.outputs) == _shape(
        known.outputs
    )


def suggested(graph: Graph, known: Action) -> Renames:
    """Return the renames of parameters that are likely between the library action `known` and its
    uses in a graph: over all uses together, exactly one parameter of a type was removed and exactly
    one of this type was added."""
    uses = uses_of(graph, known.name)
    return Renames(
        _swapped([use.inputs for use in uses], known.inputs),
        _swapped([use.outputs for use in uses], known.outputs),
    )


def updated(graph: Graph, known: Action, renames: Renames = NO_RENAMES) -> Graph:
    """Return the graph in which each use of the library action `known` has the parameters of
    `known` and keeps its own values.

    `renames`: the parameters of the library that were renamed; values and arrows follow the new
    names.
    """
    inputs, outputs = dict(renames.inputs), dict(renames.outputs)
    paths: dict[Key, _Moves] = {}
    after: dict[Key, Action] = {}
    for use in uses_of(graph, known.name):
        after[use.key] = replace(
            use,
            inputs=_parameters(use.inputs, known.inputs, inputs),
            outputs=_parameters(use.outputs, known.outputs, outputs),
        )
        paths[use.key] = _Moves(
            _moved(use.inputs, known.inputs, inputs), _moved(use.outputs, known.outputs, outputs)
        )
    names = {a.key: _Names(_flat(a.inputs), _flat(a.outputs)) for a in graph.actions}
    return replace(
        graph,
        actions=tuple(after.get(action.key, action) for action in graph.actions),
        relations=tuple(
            _led_on(relation, names, paths)
            if relation.parent in paths or relation.child in paths
            else relation
            for relation in graph.relations
        ),
    )


class _Moves(msgspec.Struct, frozen=True):
    """The new flat name of each parameter of a use, by the parameter's old flat name; None for a
    parameter that was removed."""

    inputs: dict[str, str | None] = {}
    outputs: dict[str, str | None] = {}


class _Names(msgspec.Struct, frozen=True):
    """The flat names of an action's inputs and outputs."""

    inputs: frozenset[str] = frozenset()
    outputs: frozenset[str] = frozenset()


def _flat(parameters: Iterable[Parameter]) -> frozenset[str]:
    return frozenset(flat_name(parameter.path) for parameter in parameters)


def _shape(parameters: Iterable[Parameter]) -> dict[str, Json]:
    shape: dict[str, Json] = {}
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict):
            leaf = {name: leaf.get(name, usual) for name, usual in _CONTRACT.items()}
        shape[parameter.path] = leaf
    return shape


def _defined(leaf: Json) -> Json:
    if not isinstance(leaf, dict):
        return leaf
    return {name: value for name, value in leaf.items() if name in _DEFINED}


def _kind(parameter: Parameter) -> Json:
    leaf = parse_small(parameter.text)
    return leaf.get("pvf_type") if isinstance(leaf, dict) else None


def _swapped(
    uses: list[tuple[Parameter, ...]], known: tuple[Parameter, ...]
) -> tuple[tuple[str, str], ...]:
    known_paths = {parameter.path for parameter in known}
    gone = {p.path: _kind(p) for use in uses for p in use if p.path not in known_paths}
    had = {parameter.path for use in uses for parameter in use}
    come = {p.path: _kind(p) for p in known if p.path not in had}
    pairs = []
    for path, kind in gone.items():
        same = [new for new, other in come.items() if other == kind]
        if kind is not None and len(same) == 1 and list(gone.values()).count(kind) == 1:
            pairs.append((path, same[0]))
    return tuple(pairs)


def _sources(
    use: tuple[Parameter, ...], known: tuple[Parameter, ...], renames: Mapping[str, str]
) -> dict[str, Parameter]:
    """Return, for each path of a library parameter (`known`), the parameter of the use from which
    its value comes: that of the same path, or that of the old path by `renames`. New parameters are
    absent."""
    had = {parameter.path: parameter for parameter in use}
    known_paths = {parameter.path for parameter in known}
    found = {path: parameter for path, parameter in had.items() if path in known_paths}
    for old, new in renames.items():
        if old in had and new in known_paths and old not in known_paths and new not in had:
            found[new] = had[old]
    return found


def _parameters(
    use: tuple[Parameter, ...], known: tuple[Parameter, ...], renames: Mapping[str, str]
) -> tuple[Parameter, ...]:
    sources = _sources(use, known, renames)
    new = tuple(
        p if (old := sources.get(p.path)) is None else Parameter(p.path, _text(old.text, p.text))
        for p in known
    )
    return use if set(new) == set(use) else new  # a different order is no change


def _text(use: str, known: str) -> str:
    """Return the JSON text of a parameter with the type, limits and descriptions of the library
    (`known`), and with all other members, such as the value, of the use. A value that does not fit
    a new type is removed."""
    mine, new = parse_small(use), parse_small(known)
    if not isinstance(mine, dict) or not isinstance(new, dict):
        return known if _defined(mine) != _defined(new) else use
    if _defined(mine) == _defined(new):
        return use
    own = {name: value for name, value in mine.items() if name not in _DEFINED}
    kind = new.get("pvf_type")
    if kind != mine.get("pvf_type") and kind in NATIVE and not _fits(kind, own.get("pvf_value")):
        # No engine would take this value: the preview shows that it is removed.
        own.pop("pvf_value", None)
    return dump({**{name: value for name, value in new.items() if name in _DEFINED}, **own})


def _fits(kind: Json, value: Json) -> bool:
    return isinstance(kind, str) and fits(kind, value)


def _moved(
    use: tuple[Parameter, ...], known: tuple[Parameter, ...], renames: Mapping[str, str]
) -> dict[str, str | None]:
    to = {old.path: new for new, old in _sources(use, known, renames).items()}
    return {flat_name(p.path): flat_name(to[p.path]) if p.path in to else None for p in use}


def _led_on(
    relation: Relation, names: Mapping[Key, _Names], moves: Mapping[Key, _Moves]
) -> Relation:
    """Return the relation with renamings by which it hands over the same values as before the
    update, under the new names.

    `names`: the flat names of each action before the update; `moves`: the new names in each updated
    action.
    """
    outputs = moves.get(relation.parent, _Moves()).outputs
    inputs = moves.get(relation.child, _Moves()).inputs
    remap: list[Remap] = []
    for pair in relation.remap:
        source, target = outputs.get(pair.source, pair.source), inputs.get(pair.target, pair.target)
        if source is not None and target is not None and source != target:
            remap.append(Remap(source, target))
    renamed = {pair.source for pair in relation.remap}
    given = names.get(relation.parent, _Names()).outputs
    taken = names.get(relation.child, _Names()).inputs
    for name in sorted((given & taken) - renamed):
        source, target = outputs.get(name, name), inputs.get(name, name)
        if source is not None and target is not None and source != target:
            remap.append(Remap(source, target))
    return relation if tuple(remap) == relation.remap else replace(relation, remap=tuple(remap))
