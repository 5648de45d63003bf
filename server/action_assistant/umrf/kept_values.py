"""Keeps the outputs of an action in its piece, so that an answer of the robot shows them.

An engine clears the outputs of an action at its end, but shows the inputs of actions that wait. So the
action of a piece gets children, the keepers: they take its outputs as inputs, and never run, since
nobody gives one of their required inputs (docs/decisions/114-values-by-a-package.md). Pure.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

import msgspec

from action_assistant.umrf.json.text import dump
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
    Remap,
    Signature,
)
from action_assistant.umrf.parameters import NATIVE, fits
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of

#: The action of the helper package. An engine destroys the actions of a graph from the last name to the
#: first: a keeper that comes after the action whose values it holds outlives no library that made them.
KEEPER: Final = "ZzKeepValues"
KEEPER_PACKAGE: Final = "zz_keep_values"
#: The required input of a keeper that never gets a value.
NEVER: Final = "never_given"
#: Outputs that one keeper takes. It has an input of each native type for each of them.
_OUTPUTS_EACH: Final = 4
#: Bytes of the values of one action, as the robot writes them; more are refused.
MOST_BYTES: Final = 64 * 1024
#: Inputs of a keeper, by name: the index of the output among those of the keeper, and the type. The engine
#: renames outputs in place and finds the others only while their order stays: so these names come before
#: every usual one, and are ordered by index first.
_INPUT_TYPES: Final[Mapping[str, tuple[int, str]]] = {
    f"A{index}_{kind}": (index, kind) for index in range(_OUTPUTS_EACH) for kind in sorted(NATIVE)
}
#: Arrows that hand values on, each with these outputs and their types.
ValueArrows: TypeAlias = Sequence[tuple[Relation, dict[str, str]]]
_TAKEN: Final = frozenset({"run", "stop", "pause", "restart"})  # responses that take values


def keeper(number: int = 0, key: Key = KEEPER) -> Action:
    """Return the keeper (the action of the helper package, which holds values until they are read),
    as its file describes it, with this number and key."""
    leaves = {name: kind for name, (_, kind) in _INPUT_TYPES.items()} | {NEVER: "string"}
    return Action(
        key=key,
        name=KEEPER,
        instance_id=number,
        description="Keeps values of another action until they are read. It never runs.",
        inputs=tuple(Parameter(name, dump({"pvf_type": kind})) for name, kind in leaves.items()),
    )


def has_keeper(known: Mapping[str, Signature]) -> bool:
    """Return whether an engine has the helper package. `known`: the signatures of the actions that
    it has indexed, by name."""
    found = known.get(KEEPER)
    wanted = {name: kind for name, (_, kind) in _INPUT_TYPES.items()} | {NEVER: "string"}
    return found is not None and found.inputs == wanted and not found.outputs


def is_keeper(node: str) -> bool:
    """Return whether a full name (`node`) is that of a keeper."""
    return node.startswith(f"{KEEPER}_")


class KeptOutput(msgspec.Struct, frozen=True):
    """An output of an action that a keeper takes. `key`: that of its value in `KeptValues.values`."""

    name: str
    type: str
    key: str


def kept_outputs(action: Action) -> tuple[KeptOutput, ...]:
    """Return the outputs of an action that keepers can take: outputs of native types; () if the
    engine would not find them after they are renamed."""
    outputs = slots_of(action.outputs)
    if action.name == KEEPER or not any(slot.type in NATIVE for slot in outputs.values()):
        return ()
    found: list[KeptOutput] = []
    for number in range(-(-len(outputs) // _OUTPUTS_EACH)):
        try:
            inputs = renamed(outputs, _remap(tuple(outputs), _types(action), number), _INPUT_TYPES)
        except RemapUnknown:
            return ()
        for taken_as, name in inputs.items():
            index, kind = _INPUT_TYPES[taken_as]
            if outputs[name].type == kind:
                found.append(KeptOutput(name, kind, f"{number * _OUTPUTS_EACH + index}_{kind}"))
    wanted = [name for name, slot in outputs.items() if slot.type in NATIVE]
    return tuple(found) if [each.name for each in found] == wanted else ()


def with_keepers(piece: Graph, action: Action, *, taken_on_false: bool) -> Graph:
    """Return a piece with keepers added: actions that hold the outputs of `action`, so that an
    answer of the robot shows them. `taken_on_false`: other actions need the outputs also when the
    action ends with false. With it, the piece ends (FINISHED) only when the action ends with true;
    when it ends with false, the piece stays RUNNING, and its keepers hold the outputs."""
    outputs = slots_of(action.outputs)
    keepers: list[Action] = []
    arrows: list[Relation] = []
    for number in range(-(-len(outputs) // _OUTPUTS_EACH)):
        key = f"{action.key}-{KEEPER}-{number}"
        keepers.append(keeper(number, key))
        arrows.append(
            Relation(
                parent=action.key,
                child=key,
                conditions=Conditions(
                    on_true="run", on_false="run" if taken_on_false else "ignore"
                ),
                remap=_remap(tuple(outputs), _types(action), number),
                parent_order=float(number),
            )
        )
    own = tuple(
        msgspec.structs.replace(each, conditions=Conditions(on_true="bypass"))
        if each.child == EXIT and taken_on_false
        else each
        for each in piece.relations
    )
    return msgspec.structs.replace(
        piece, actions=(*piece.actions, *keepers), relations=(*own, *arrows)
    )


def _types(action: Action) -> dict[str, str]:
    return {name: slot.type for name, slot in slots_of(action.outputs).items()}


def _remap(outputs: tuple[str, ...], types: Mapping[str, str], number: int) -> tuple[Remap, ...]:
    """Return the renamings of an action's outputs (sorted names) on the arrow to the keeper with
    this number. The outputs that this keeper takes get the names of its inputs, all others get
    names that keep the order and are no inputs. `types`: the types of the outputs, by name."""
    first = number * _OUTPUTS_EACH
    names: list[Remap] = []
    for index, output in enumerate(outputs):
        if index < first:
            name = f"!{index:06d}"
        elif index < first + _OUTPUTS_EACH:
            name = f"A{index - first}_{types[output] if types[output] in NATIVE else 'other'}"
        else:
            name = f"A{_OUTPUTS_EACH}_{index:06d}"
        names.append(Remap(output, name))
    return tuple(names)


class KeptValues(msgspec.Struct, frozen=True, omit_defaults=True):
    """The values that the keepers of a graph hold: JSON texts by index and type of the output
    (`0_number`). `wrong`: why some are missing, as part of a sentence."""

    values: dict[str, str] = {}
    wrong: str = ""


NOTHING_KEPT: Final = KeptValues()


class _Leaf(msgspec.Struct, frozen=True):
    pvf_type: str = ""
    pvf_value: Any = msgspec.UNSET


_INPUTS: Final = msgspec.json.Decoder(dict[str, _Leaf])
_MOST_TEXT: Final = 4 * MOST_BYTES  # an engine indents what it writes
_TOO_LARGE: Final = KeptValues(wrong=f"its values are larger than {MOST_BYTES // 1024} KB")


def kept_in(keepers: Mapping[int, bytes]) -> KeptValues:
    """Return the values that keepers hold. `keepers`: the text of the `input_parameters` of each,
    as an engine wrote it, by number. The texts come from machines that are not trusted."""
    if sum(map(len, keepers.values())) > _MOST_TEXT:
        return _TOO_LARGE
    found: dict[str, str] = {}
    for number, text in sorted(keepers.items()):
        try:
            inputs = _INPUTS.decode(text)
        except (msgspec.DecodeError, RecursionError, UnicodeError):
            return KeptValues(wrong="its values cannot be read")
        for name, (index, kind) in _INPUT_TYPES.items():
            leaf = inputs.get(name)
            if leaf is None or leaf.pvf_value is msgspec.UNSET:
                continue
            if leaf.pvf_type != kind or not fits(kind, leaf.pvf_value):
                return KeptValues(wrong=f"a value that it gave is no {kind}")
            found[f"{number * _OUTPUTS_EACH + index}_{kind}"] = as_json(leaf.pvf_value)
    return _TOO_LARGE if sum(map(len, found.values())) > MOST_BYTES else KeptValues(found)


def is_given(text: bytes) -> bool:
    """Return whether a keeper may run after all, or cannot be read. `text`: its `input_parameters`
    as an engine wrote them."""
    try:
        never = _INPUTS.decode(text).get(NEVER)
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return True
    return never is None or never.pvf_value is not msgspec.UNSET


def as_json(value: Any) -> str:
    """Return a value of a parameter as JSON text."""
    return msgspec.json.encode(value).decode()


def value_arrows(graph: Graph) -> Iterator[tuple[Relation, dict[str, str]]]:
    """Yield each arrow that hands values from action to action, with the names of these outputs and
    their types."""
    actions = {action.key: action for action in graph.actions if not action.missing}
    for relation in graph.relations:
        parent, child = actions.get(relation.parent), actions.get(relation.child)
        if parent is None or child is None or not takes(relation):
            continue
        inputs, outputs = slots_of(child.inputs), slots_of(parent.outputs)
        try:
            given = renamed(outputs, relation.remap, inputs)
        except RemapUnknown:
            continue  # a problem of the graph itself
        handed = {
            output: outputs[output].type
            for name, output in given.items()
            if inputs[name].type == outputs[output].type and inputs[name].updatable
        }
        if handed:
            yield relation, dict(sorted(handed.items()))


def takes(relation: Relation, outcomes: tuple[Precondition, ...] = PRECONDITIONS) -> bool:
    """Return whether the child of an arrow takes values of its parent after any of these outcomes."""
    return any(relation.conditions.answer(outcome) in _TAKEN for outcome in outcomes)


def taken_on_false(graph: Graph, arrows: ValueArrows) -> frozenset[Key]:
    """Return the keys of the actions whose values another action, or the exit of the graph, takes
    after they have ended with false. `arrows`: all that hand values on, as `value_arrows` yields.
    """
    handed = {each.parent for each, _ in arrows}
    taking = [each for each, _ in arrows]
    taking += [each for each in graph.relations if each.child == EXIT and each.parent in handed]
    return frozenset(each.parent for each in taking if takes(each, ("on_false",)))


def receiving(graph: Graph, arrows: ValueArrows) -> dict[Key, frozenset[str]]:
    """Return the flat names of the inputs to which an arrow may hand a value, by key of their
    action. `arrows`: all that hand values on, as `value_arrows` yields."""
    actions = {action.key: action for action in graph.actions if not action.missing}
    found: dict[Key, set[str]] = {}
    for relation, _ in arrows:
        parent, child = actions[relation.parent], actions[relation.child]
        inputs = slots_of(child.inputs)
        given = renamed(slots_of(parent.outputs), relation.remap, inputs)
        native = {name for name in given if inputs[name].type in NATIVE}
        found.setdefault(relation.child, set()).update(native)
    return {key: frozenset(names) for key, names in found.items()}


def unreadable_arrows(
    graph: Graph, arrows: ValueArrows
) -> Iterator[tuple[Relation, dict[str, str], str]]:
    """Yield each arrow whose values cannot be handed from one piece to another, with its outputs
    and their types, and the reason as the end of a sentence. `arrows`: all that hand values on, as
    `value_arrows` yields."""
    actions = {action.key: action for action in graph.actions if not action.missing}
    stopped = {
        each.child
        for each in graph.relations
        if each.parent != ENTRY and "stop" in map(each.conditions.answer, PRECONDITIONS)
    }
    for relation, handed in arrows:
        opaque = next((kind for kind in handed.values() if kind not in NATIVE), None)
        if opaque is not None:
            kind = f"of the type {opaque}" if opaque else "without a type"
            why = (
                "only numbers, strings, bools and lists of them can be read from a robot, and no value "
                f"{kind}."
            )
        elif takes(relation, ("on_stopped",)) and relation.parent in stopped:
            name = actions[relation.parent].full_name
            why = (
                f"an arrow may have stopped {name}, and what a stopped action gives cannot be read."
            )
        elif not kept_outputs(actions[relation.parent]):
            name = actions[relation.parent].full_name
            why = f"the engine would not find the outputs of {name} under other names."
        else:
            continue
        yield relation, handed, why


def names_in_words(names: Collection[str]) -> str:
    """Return the names of parameters for a sentence: the first three, and how many more."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(f"“{name}”" for name in list(names)[:3]) + more
