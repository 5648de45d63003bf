"""Checks the structure of a graph: fields that the engine's parser refuses, and names that lead
nowhere.

See docs/umrf-and-the-engine.md 1; H6.
"""

import re
from typing import Final

from action_assistant.umrf.checks.places import Subject, quoted
from action_assistant.umrf.json.text import Json, Number, dump, parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Parameter, Relation, Severity
from action_assistant.umrf.parameters import MAX_PATH, NATIVE, fits, keys_of
from action_assistant.umrf.relations import MAX_REFERRED_ID, condition_of, remap_of, whole_of

_TEXTS: Final = {"name", "type", "actor", "description", "graph_name", "graph_description"}
_LISTS: Final = {"parents", "children", "graph_entry", "graph_exit", "actions"}
_OBJECTS: Final = {"input_parameters", "output_parameters"}
_CLASS: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
#: The most characters in the name of a graph or an action.
MAX_NAME: Final = 200
#: The number of characters of a wrong text that are quoted.
_SHOWN: Final = 80
TYPES: Final = ("sync", "async", "spontaneous")


def check_structure(subject: Subject) -> None:
    """Report in `subject` all problems of the structure: names, numbers, types, fields and
    relations that the engine refuses or misreads."""
    graph = subject.graph
    for field, text in graph.extra:
        _check_known(subject, field, parse_small(text), f"/{field}", None)
    if not graph.name:
        message = "The graph has no name: nobody can tell it from others, so no robot is sent it."
        subject.report("graph-name-empty", "error", message)
    elif why := _unsendable(graph.name):
        message = f"The name of the graph {why}"
        subject.report("graph-name", "error", message, member="/graph_name")
    for action in subject.real:
        _check_action(subject, action)
    _check_doubles(subject)
    for relation in subject.relations:
        _check_relation(subject, relation)


def _check_known(
    subject: Subject, field: str, value: Json, member: str, action: Action | None
) -> None:
    """Report a field of the format whose value has the wrong type, so that it was stored among the
    unknown fields (`extra`). `member`: its JSON pointer below the `action`, or below the graph if
    that is None."""
    wanted = None
    if field in _TEXTS and not isinstance(value, str):
        wanted = "a text"
    elif field in _LISTS and not isinstance(value, list):
        wanted = "a list"
    elif field in _OBJECTS and not isinstance(value, dict):
        wanted = "an object"
    elif field == "required" and not isinstance(value, bool):
        wanted = "true or false"
    if wanted is not None:
        message = f"“{field}” must be {wanted}; the engine refuses the graph."
        subject.report("value-type", "error", message, action=action, member=member)


def _check_number(value: Json) -> tuple[str, Severity, str] | None:
    """Return code, severity and message of the problem of an `instance_id` (`value`) that is not
    valid; None for a valid one."""
    if whole_of(value)[1]:
        return None
    if isinstance(value, Number):
        if float(value.text) > 0 and float(value.text) <= MAX_REFERRED_ID:
            return (
                "instance-id-cut",
                "warning",
                f"The number {value.text} is not a whole number; the engine cuts it.",
            )
        return (
            "instance-id",
            "error",
            f"The number {value.text} is out of range; relations miss the action.",
        )
    return "value-type", "error", "“instance_id” must be a number; the engine refuses the graph."


def _check_action(subject: Subject, action: Action) -> None:
    extra = {field: parse_small(text) for field, text in action.extra}
    for field, value in extra.items():
        _check_known(subject, field, value, f"/{field}", action)
        if field == "instance_id" and (found := _check_number(value)):
            subject.report(*found, action=action, member="/instance_id")
    if why := _unsendable(action.name):
        message = f"The name of the action {why}"
        subject.report("action-name", "error", message, action=action, member="/name")
    if not action.name and "name" not in extra:
        message = "The action has no name; the engine refuses the graph."
        subject.report("name-empty", "error", message, action=action, member="/name")
    elif action.name in ("graph_entry", "graph_exit"):
        _check_reserved(subject, action)
    elif action.name and not _CLASS.fullmatch(action.name):
        message = (
            f"“{action.name}” cannot be the name of a C++ class, so no action package can have it."
        )
        subject.report("name-class", "warning", message, action=action, member="/name")
    if not action.type and "type" not in extra:
        message = "The action has no type; the engine refuses the graph."
        subject.report(
            "type-empty", "error", message, action=action, member="/type", fix="type-sync"
        )
    elif action.type not in TYPES and "type" not in extra:
        message = f"The engine knows no type “{action.type}” and treats the action like sync."
        subject.report("type-unknown", "warning", message, action=action, member="/type")
    if action.instance_id > MAX_REFERRED_ID and "instance_id" not in extra:
        message = (
            f"Relations cannot refer to numbers above {MAX_REFERRED_ID:,}; the engine cuts them."
        )
        subject.report(
            "instance-id", "error", message, action=action, member="/instance_id", fix="renumber"
        )
    for field, parameters in (
        ("input_parameters", action.inputs),
        ("output_parameters", action.outputs),
    ):
        if field not in extra:
            _check_parameters(subject, action, field, parameters)


def _unsendable(name: str) -> str | None:
    """Return the reason for which no robot is sent this name, as the end of a sentence; None if it
    can be sent.

    Blanks, letters of any script and other characters are sent as they are: the engine takes them.
    """
    if _CONTROL.search(name):
        return "contains a control character, which no log or file can carry."
    if "%" in name:
        return "contains %: the engine logs errors about it as formats, and dies of that with every running graph."
    if len(name) > MAX_NAME:
        return f"has {len(name):,} characters; {MAX_NAME} can be sent."
    return None


def _check_reserved(subject: Subject, action: Action) -> None:
    if action.instance_id == 0:
        message = f"“{action.full_name}” is the engine's own name for an end of the graph: the start throws, and a broken graph stays in the engine."
        subject.report("H6", "error", message, action=action, member="/name", fix="renumber")
    else:
        message = (
            f"“{action.name}” is a name that the engine uses itself: it never runs the action."
        )
        subject.report("name-reserved", "warning", message, action=action, member="/name")


def _check_doubles(subject: Subject) -> None:
    seen: dict[str, Action] = {}
    for action in subject.real:
        first = seen.setdefault(action.full_name, action)
        if first is not action:
            message = f"There are two actions {action.full_name}: the start throws, and a broken graph stays in the engine."
            subject.report(
                "H6", "error", message, action=action, member="/instance_id", fix="renumber"
            )


# Relations


def _check_relation(subject: Subject, relation: Relation) -> None:
    for key in (relation.parent, relation.child):
        other = subject.actions.get(key)
        if other is not None and other.missing:
            ends = {ENTRY: "The graph starts with", EXIT: "The graph ends after"}
            who = ends.get(relation.parent) or ends.get(relation.child)
            owner = relation.child if key == relation.parent else relation.parent
            who = who or f"{subject.name(owner)} refers to"
            message = f"{who} “{other.full_name}”, which does not exist; the engine refuses the graph or aborts."
            subject.report("ghost", "error", message, relation=relation, fix="remove-relation")
            return
    for field, text in relation.parents_extra:
        _check_parent_field(subject, relation, field, parse_small(text))
    for field, text in relation.children_extra:
        _check_child_field(subject, relation, field, parse_small(text))
    if relation.listing:
        message = f"{subject.name(relation.parent)} and {subject.name(relation.child)} are related more than once; the engine looks at one of them only."
        subject.report(
            "relation-repeated", "warning", message, relation=relation, fix="remove-relation"
        )


def _check_parent_field(subject: Subject, relation: Relation, field: str, value: Json) -> None:
    member = f"/{field}"
    if field == "conditions":
        _check_conditions(subject, relation, value)
    elif field == "required" and not isinstance(value, bool):
        message = "“required” must be true or false; the engine refuses the graph."
        subject.report("value-type", "error", message, relation=relation, member=member)
    elif field == "instance_id" and (found := _check_number(value)):
        subject.report(*found, relation=relation, member=member)
    elif field == "remap":
        message = "A renaming on the child's side is ignored; it belongs to the parent's side."
        subject.report(
            "wrong-side", "warning", message, relation=relation, member=member, side="parents"
        )


def _check_conditions(subject: Subject, relation: Relation, value: Json) -> None:
    """Report each condition in the list `value` of a relation that the engine refuses, at its own
    place in the list; or that `value` is no list."""
    if not isinstance(value, list):
        message = "“conditions” must be a list of texts; the engine refuses the graph."
        subject.report(
            "condition-illegal", "error", message, relation=relation, member="/conditions"
        )
        return
    for index, item in enumerate(value):
        if condition_of(item) is None:
            member = f"/conditions/{index}"
            text = f"“{item}”" if isinstance(item, str) else dump(item)[:_SHOWN]
            if isinstance(item, str) and len(item) > _SHOWN:
                text = f"“{item[:_SHOWN]}” …"
            message = (
                f"{text} is no condition that the engine knows, such as on_true -> run; it refuses "
                "the graph."
            )
            subject.report("condition-illegal", "error", message, relation=relation, member=member)


def _check_child_field(subject: Subject, relation: Relation, field: str, value: Json) -> None:
    member = f"/{field}"
    if field == "remap" and not remap_of(value)[1]:
        message = "This renaming repeats a source or lacks an end; the engine refuses the graph or aborts."
        subject.report("remap-illegal", "error", message, relation=relation, member="/remap")
    elif field == "instance_id" and (found := _check_number(value)):
        subject.report(*found, relation=relation, member=member, side="children")
    elif field in ("conditions", "required") and relation.parent != ENTRY:
        message = f"“{field}” on the parent's side is ignored; it belongs to the child's side."
        subject.report(
            "wrong-side", "warning", message, relation=relation, member=member, side="children"
        )


# Parameters


def _check_parameters(
    subject: Subject, action: Action, field: str, parameters: tuple[Parameter, ...]
) -> None:
    leaves = {keys_of(parameter.path) for parameter in parameters}
    flat: dict[str, str] = {}
    for parameter in parameters:
        keys = keys_of(parameter.path)
        member = f"/{field}/{parameter.path}"
        if len(keys) > MAX_PATH or any(keys[:n] in leaves for n in range(1, len(keys))):
            message = f"“{parameter.path}” lies inside another parameter and is not written."
            subject.report("parameter-inside", "warning", message, action=action, member=member)
            continue
        if refusal := refusal_of(parse_small(parameter.text)):
            message = f"The parameter “{'::'.join(keys)}” {refusal}; the engine refuses the graph."
            subject.report("parameter-illegal", "error", message, action=action, member=member)
        strange = {key for key in keys if not key or ":" in key}
        if strange:
            message = f"{quoted(strange)} is no name that the engine can find again."
            subject.report("parameter-name", "warning", message, action=action, member=member)
        first = flat.setdefault("::".join(keys), parameter.path)
        if first != parameter.path:
            message = f"“{parameter.path}” is one parameter with {first} for the engine."
            subject.report("parameter-name", "warning", message, action=action, member=member)


def refusal_of(value: Json) -> str | None:
    """Return the reason for which the engine's parser refuses one parameter (`value`, as JSON
    data), as the end of a sentence; None if it accepts it."""
    if not isinstance(value, dict):
        return "must be an object"
    if "pvf_type" not in value:
        return next(filter(None, map(refusal_of, value.values())), None)
    kind = value["pvf_type"]
    if not isinstance(kind, str):
        return "has a pvf_type that is no text"
    if "pvf_value" in value and not fits(kind, value["pvf_value"]):
        return _misfit("has a pvf_value", "that is no", kind)
    for flag in ("pvf_required", "pvf_updatable"):
        if not isinstance(value.get(flag, True), bool):
            return f"has a {flag} that is neither true nor false"
    allowed = value.get("pvf_allowed_values")
    if isinstance(allowed, list) and not all(fits(kind, member) for member in allowed):
        return _misfit("allows values", "that are no", kind)
    return None


def _misfit(what: str, none: str, kind: str) -> str:
    """Return, as part of a sentence, the reason for which one or several values (`what`) do not fit
    the type `kind`. `none`: the words before a type of the engine, as “that is no”. The engine
    reads no value of any other type."""
    if kind in NATIVE:
        return f"{what} {none} {kind}"
    if not kind:
        return f"{what}, and its pvf_type is empty"
    return f"{what}, and of the type “{kind}” the engine reads none"
