"""The values that people give a graph when they start it: which inputs are asked for, and the graph with them.

A start asks for an input that the graph leaves open, and for one that its author marks. A mark stands
in the `gui_attributes` of its action, which no engine reads and no digest covers. Pure.
"""

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Annotated, Any, Final, TypeAlias

import msgspec

from action_assistant.safe_text import hold_names
from action_assistant.umrf.json.text import Json, dump, parse_small, pointer
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.model import ENTRY, Action, Graph, JsonText, Key, Parameter, Relation
from action_assistant.umrf.parameters import NATIVE, fits, flat_name
from action_assistant.umrf.semantics.values import RemapUnknown, Slot, plain, renamed, slots_of

_Name = Annotated[str, msgspec.Meta(max_length=1000)]
_Single: TypeAlias = bool | float | str
#: A value that a person gives, of one of the types that engines read.
Value: TypeAlias = _Single | tuple[_Single, ...]
#: Values by the full name of the action and the flat name of the input.
StartValues: TypeAlias = Annotated[
    dict[_Name, Annotated[dict[_Name, Value], msgspec.Meta(max_length=1000)]],
    msgspec.Meta(max_length=1000),
]
#: Bytes of all values of a start, as JSON.
MOST_BYTES: Final = 64 * 1024


class AskedInput(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An input for which a start asks. `action`, `name`: its full and flat name; `aid`: the key of the
    action; `open`: the graph has no value for it and cannot run without; `value`: the one that it has
    otherwise; `allowed`: the values that it can have, if not all; `least`, `most`: the bounds that its
    author set."""

    action: str
    name: str
    aid: Key
    type: str
    open: bool
    value: Value | None = None
    example: Value | None = None
    allowed: tuple[Value, ...] = ()
    least: float | None = None
    most: float | None = None
    description: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "description")


class WrongValue(ValueError):
    """A value cannot be given to a graph. `action`, `name`: its place, "" for all inputs of an action;
    `path`: its JSON pointer in the body of a request."""

    def __init__(self, text: str, action: str, name: str = "") -> None:
        super().__init__(text)
        self.action = action
        self.name = name
        self.path = pointer("values", *(each for each in (action, name) if each))


class _Bounds(msgspec.Struct, frozen=True):
    """The bounds in a mark of an author; a mark of any other form has none."""

    least: float | None = None
    most: float | None = None


def asked_inputs(graph: Graph) -> tuple[AskedInput, ...]:
    """Return the inputs for which a start of this graph asks, in the order of the file."""
    arrows = _Arrows(graph)
    return tuple(found for action in graph.actions for found in _asked(arrows, action))


def with_values(graph: Graph, values: Mapping[str, Mapping[str, Any]]) -> Graph:
    """Return the graph with the values that a person gives it. Raise WrongValue for one that is not
    asked for, or that the input cannot have."""
    if not values:
        return graph
    if len(as_json(values)) > MOST_BYTES:
        raise WrongValue(f"The values of a start have {MOST_BYTES:,} bytes at most.", "")
    asked = {(each.action, each.name): each for each in asked_inputs(graph)}
    actions = {each.full_name: each for each in graph.actions if not each.missing}
    for name, given in values.items():
        if name not in actions:
            raise WrongValue(f"The graph has no action {name}.", name)
        for input_, value in given.items():
            each = asked.get((name, input_))
            if each is None:
                raise WrongValue(_not_asked(graph, actions[name], input_), name, input_)
            wrong = why_wrong(each, value)
            if wrong:
                raise WrongValue(f"{input_} of {name} {wrong}", name, input_)
    return msgspec.structs.replace(
        graph,
        actions=tuple(
            each if each.missing else _filled(each, values.get(each.full_name, {}))
            for each in graph.actions
        ),
    )


def why_wrong(asked: AskedInput, value: Any) -> str:
    """Return why an input cannot have a value, as the rest of a sentence; "" if it can."""
    single = isinstance(value, list | tuple)
    if not fits(asked.type, list(value) if single else value):
        return f"is a {asked.type}, and this is none."
    members = list(value) if single else [value]
    if asked.allowed and any(each not in asked.allowed for each in members):
        return f"is one of {', '.join(map(as_json, asked.allowed))}."
    for each in members:
        if isinstance(each, bool | str):
            continue
        if isinstance(each, float) and not isfinite(each):
            return "is a finite number."
        if asked.least is not None and each < asked.least:
            return f"is {asked.least:g} at least."
        if asked.most is not None and each > asked.most:
            return f"is {asked.most:g} at most."
    return ""


class _Arrows:
    """The arrows of a graph by the actions to which they lead, and what they bring."""

    def __init__(self, graph: Graph) -> None:
        self._parents = {each.key: each for each in graph.actions}
        self._into: dict[Key, list[Relation]] = {}
        for each in graph.relations:
            self._into.setdefault(each.child, []).append(each)

    def into(self, action: Action) -> list[Relation]:
        """Return the arrows that lead to an action."""
        return self._into.get(action.key, [])

    def brought(self, action: Action, inputs: Mapping[str, Slot]) -> list[frozenset[str]]:
        """Return which inputs of an action get a value, for each arrow from another action."""
        return [self._brought(each, inputs) for each in self.into(action) if each.parent != ENTRY]

    def _brought(self, arrow: Relation, inputs: Mapping[str, Slot]) -> frozenset[str]:
        parent = self._parents.get(arrow.parent)
        if parent is None:
            return frozenset()
        outputs, open_ = slots_of(parent.outputs), {n: s for n, s in inputs.items() if s.updatable}
        try:
            places = renamed(outputs, arrow.remap, open_)
        except RemapUnknown:
            return frozenset()
        return frozenset(n for n, place in places.items() if outputs[place].type == open_[n].type)


def _asked(arrows: _Arrows, action: Action) -> Iterator[AskedInput]:
    if action.missing or action.twin:
        return
    marks = dict(action.asks)
    inputs = slots_of(action.inputs)
    if not any(each.required and not each.has_value() for each in inputs.values()) and not marks:
        return
    incoming = arrows.into(action)
    is_entry = any(each.parent == ENTRY for each in incoming)
    brought = arrows.brought(action, inputs)
    seen = set[str]()
    for parameter in action.inputs:
        name, leaf = flat_name(parameter.path), parse_small(parameter.text)
        slot = inputs.get(name)
        if slot is None or slot.type not in NATIVE or name in seen or not isinstance(leaf, dict):
            continue
        seen.add(name)
        comes = any(name in each for each in brought)
        is_open = slot.required and not slot.has_value() and (is_entry or not comes)
        always = bool(brought) and not is_entry and all(name in each for each in brought)
        if (is_open and incoming) or (parameter.path in marks and not always):
            yield _asked_input(action, slot, leaf, marks.get(parameter.path), is_open=is_open)


def _asked_input(
    action: Action, slot: Slot, leaf: Mapping[str, Json], mark: JsonText | None, *, is_open: bool
) -> AskedInput:
    bounds = _bounds(mark)
    texts = {key: leaf.get(f"pvf_{key}") for key in ("description", "unit")}
    allowed = tuple(_value(slot.type.removesuffix("s"), each) for each in slot.allowed)
    example = leaf.get("pvf_example")
    return AskedInput(
        action=action.full_name,
        name=slot.name,
        aid=action.key,
        type=slot.type,
        open=is_open,
        value=_value(slot.type, slot.value) if slot.has_value() else None,
        example=None if example is None else _value(slot.type, plain(example)),
        allowed=tuple(each for each in allowed if each is not None),
        least=bounds.least,
        most=bounds.most,
        **{key: text for key, text in texts.items() if isinstance(text, str)},
    )


def _bounds(mark: JsonText | None) -> _Bounds:
    try:
        return _Bounds() if mark is None else msgspec.json.decode(mark, type=_Bounds)
    except (msgspec.ValidationError, msgspec.DecodeError):
        return _Bounds()


def _value(kind: str, value: Any) -> Value | None:
    """Return a value of the graph; None if it is none of its type."""
    if not fits(kind, value):
        return None
    return tuple(value) if isinstance(value, list) else value


def _not_asked(graph: Graph, action: Action, name: str) -> str:
    inputs = slots_of(action.inputs)
    if name not in inputs:
        return f"{action.full_name} has no input {name}."
    if any(name in each for each in _Arrows(graph).brought(action, inputs)):
        return f"An arrow brings {name} of {action.full_name}: no start can set it."
    return (
        f"The graph does not ask for {name} of {action.full_name}: it has a value there, and its author "
        "has not marked it as asked at the start."
    )


def _filled(action: Action, values: Mapping[str, Any]) -> Action:
    if not values:
        return action
    return msgspec.structs.replace(
        action, inputs=tuple(_with_value(each, values) for each in action.inputs)
    )


def _with_value(parameter: Parameter, values: Mapping[str, Any]) -> Parameter:
    name, leaf = flat_name(parameter.path), parse_small(parameter.text)
    if name not in values or not isinstance(leaf, dict) or "pvf_type" not in leaf:
        return parameter
    value = parse_small(as_json(values[name]))
    return Parameter(parameter.path, dump({**leaf, "pvf_value": value}))
