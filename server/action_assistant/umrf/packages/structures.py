"""Describes parameters of an action as C++ structs: nested structs with a member for each value."""

import math
from collections.abc import Iterator
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.json.text import Json, Number, parse_small
from action_assistant.umrf.model import Action, Parameter
from action_assistant.umrf.packages.naming import NameRefusal, member_name
from action_assistant.umrf.parameters import MAX_PATH, fits, flat_name, keys_of

Field: TypeAlias = Literal["input_parameters", "output_parameters"]
Scalar: TypeAlias = str | float | bool
Initial: TypeAlias = Scalar | tuple[Scalar, ...] | None

#: C++ types by native types. The engine passes values of other types on as an action gave them.
CPP_TYPES: Final = {
    "string": "std::string",
    "strings": "std::vector<std::string>",
    "number": "double",
    "numbers": "std::vector<double>",
    "bool": "bool",
    "bools": "std::vector<bool>",
}
OPAQUE: Final = "boost::any"


class StructValue(msgspec.Struct, frozen=True):
    """One parameter. `flat`: its name in the engine (`pose::x`); `access`: its path below the
    outermost struct (`pose.x`).

    `kind`: its type in the file. `initial`: its value until code sets another one; None for an
    empty one.
    """

    flat: str
    access: str
    kind: str
    required: bool
    initial: Initial = None

    @property
    def cpp_type(self) -> str:
        """The C++ type of the struct member for this parameter."""
        return CPP_TYPES.get(self.kind, OPAQUE)

    @property
    def opaque(self) -> bool:
        """True if only actions know the type of the value."""
        return self.kind not in CPP_TYPES


class StructLine(msgspec.Struct, frozen=True):
    """One line of a declaration, `depth` levels in.

    `open` begins a struct (`name` is its type), `member` declares a value, `close` ends a struct
    (`name` is the member of the type `kind`; empty for the outermost struct).
    """

    does: Literal["open", "member", "close"]
    depth: int
    name: str
    kind: str = ""
    value: StructValue | None = None


class ParameterStruct(msgspec.Struct, frozen=True):
    """All parameters of one side. `lines` declare them, `values` are in file order."""

    lines: tuple[StructLine, ...]
    values: tuple[StructValue, ...]

    @property
    def any_opaque(self) -> bool:
        """True if one of the members is a `boost::any`."""
        return any(value.opaque for value in self.values)


class _StructGroup:
    """A struct under construction: members by their C++ names, with the keys from which they
    come."""

    def __init__(self) -> None:
        self.members: dict[str, tuple[str, _StructGroup | StructValue]] = {}


class _StructReader:
    def __init__(self, action: Action, field: Field) -> None:
        self.root = _StructGroup()
        self.values: list[StructValue] = []
        self.refusals: list[NameRefusal] = []
        self.place = f"{action.name}/{field}"
        self.gives = field == "output_parameters"

    def refuse(self, path: str, reason: str) -> None:
        self.refusals.append(NameRefusal(f"{self.place}/{path}", reason))

    def add(self, parameter: Parameter) -> None:
        """Add a parameter to the struct, or record the reason why it cannot be."""
        keys, leaf = keys_of(parameter.path), parse_small(parameter.text)
        if leaf == {}:
            return  # an empty group has no member
        reason = _against(keys, leaf) or (_against_output(leaf) if self.gives else None)
        if reason is not None:
            self.refuse(parameter.path, reason)
            return
        assert isinstance(leaf, dict)
        group, names = self.root, tuple(map(member_name, keys))
        for key, name in zip(keys[:-1], names[:-1], strict=True):
            other, below = group.members.setdefault(name, (key, _StructGroup()))
            if other != key or not isinstance(below, _StructGroup):
                self.refuse(parameter.path, _taken(key, other, name))
                return
            group = below
        value = StructValue(
            flat=flat_name(parameter.path),
            access=".".join(names),
            kind=str(leaf["pvf_type"]),
            required=leaf.get("pvf_required") is not False,
            initial=_default(leaf) if self.gives else None,
        )
        other, there = group.members.setdefault(names[-1], (keys[-1], value))
        if there is not value:
            self.refuse(parameter.path, _taken(keys[-1], other, names[-1]))
            return
        self.values.append(value)


def structure(action: Action, field: Field) -> tuple[ParameterStruct, tuple[NameRefusal, ...]]:
    """Return one side of an action (`field`: inputs or outputs) as a C++ struct, and refusals of
    parameters that C++ or the engine cannot represent."""
    reader = _StructReader(action, field)
    for parameter in action.inputs if field == "input_parameters" else action.outputs:
        reader.add(parameter)
    lines = tuple(_lines(reader.root, f"{field}_t", "", 0))
    return ParameterStruct(lines, tuple(reader.values)), tuple(reader.refusals)


def _lines(group: _StructGroup, kind: str, member: str, depth: int) -> Iterator[StructLine]:
    yield StructLine("open", depth, kind)
    for name, (_, below) in group.members.items():
        if isinstance(below, _StructGroup):
            yield from _lines(below, _type_of(name, kind, group), name, depth + 1)
        else:
            yield StructLine("member", depth + 1, name, value=below)
    yield StructLine("close", depth, member, kind)


def _type_of(name: str, around: str, group: _StructGroup) -> str:
    """Return the name of the type of a nested struct: `pose_t` for `pose`, extended if the struct
    `around` or a member of `group` has that name."""
    kind = f"{name}_t"
    others = {f"{each}_t" for each in group.members if each != name}
    while kind == around or kind in group.members or kind in others:
        kind += "_t"
    return kind


def _taken(key: str, other: str, name: str) -> str:
    if key == other:
        return f"“{key}” is there twice, or as a value and as a group."
    return f"“{key}” and “{other}” would both be the member “{name}” in C++."


def _against(keys: tuple[str, ...], leaf: Json) -> str | None:
    if len(keys) > MAX_PATH:
        return f"It lies in {len(keys) - 1} groups; {MAX_PATH - 1} can be read again."
    for key in keys:
        if not key:
            return "A key is empty, and the engine would not find it."
        if ":" in key:
            return f"The engine would split “{key}” at its colon."
        if "\x00" in key:
            return "A key has a NUL in it, where texts of C end."
    kind = leaf.get("pvf_type") if isinstance(leaf, dict) else None
    if not isinstance(leaf, dict) or not isinstance(kind, str) or not kind or "\x00" in kind:
        return "It has no `pvf_type` that is a text; the engine refuses the file."
    values = [*_allowed(leaf), *([leaf["pvf_value"]] if "pvf_value" in leaf else [])]
    if kind not in CPP_TYPES and values:
        return f"The engine reads no value of the type “{kind}”, and refuses the file that has one."
    if not all(fits(kind, value) for value in values):
        return f"It has a value that is no {kind}; the engine refuses the file."
    return None


def _against_output(leaf: Json) -> str | None:
    """Return the reason why a parameter cannot be an output; None if it can: engines compare only
    single values with allowed ones, and no lists."""
    assert isinstance(leaf, dict)
    if leaf["pvf_type"] in {"strings", "numbers", "bools"} and _allowed(leaf):
        return "The engine takes no list as an output that has allowed values."
    return None


def _allowed(leaf: dict[str, Json]) -> list[Json]:
    allowed = leaf.get("pvf_allowed_values")
    return allowed if isinstance(allowed, list) else [] if allowed is None else [allowed]


def _default(leaf: dict[str, Json]) -> Initial:
    """Return the initial value of an output (`leaf`: the parameter in the file), as in simulations:
    its value, else the first allowed value that C++ can spell, else None. An engine aborts at the
    end of an action that leaves an output with allowed values empty."""
    given = [leaf["pvf_value"]] if "pvf_value" in leaf else []
    return next(
        (said for each in (*given, *_allowed(leaf)) if (said := _spelled(each)) is not None), None
    )


def _spelled(value: Json) -> Initial:
    """Return `value` as an initial value that C++ can write as a literal: a single value, or a
    tuple for a list of single values. None for any other value."""
    if not isinstance(value, list):
        return _scalar(value)
    members = tuple(each for member in value if (each := _scalar(member)) is not None)
    return members if len(members) == len(value) else None


def _scalar(value: Json) -> Scalar | None:
    """Return the value if it is a single one that C++ can write as a literal, else None: also None
    for a text with NUL, at which a C++ text would end, and for a number that is not finite."""
    if isinstance(value, bool) or (isinstance(value, str) and "\x00" not in value):
        return value
    if isinstance(value, Number) and math.isfinite(value.value):
        return value.value
    return None
