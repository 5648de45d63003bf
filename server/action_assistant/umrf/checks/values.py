"""Checks parameters: their sources, the effect of renamings, and the signatures of a library.

See docs/umrf-and-the-engine.md 2.7; H2, H7, H8.
"""

from collections.abc import Container, Mapping

from action_assistant.umrf.checks.places import Subject, joined
from action_assistant.umrf.model import ENTRY, EXIT, Action, Key, Relation, Severity, Signature
from action_assistant.umrf.semantics.values import RemapUnknown, Slot, renamed, slots_of


def check_values(
    subject: Subject,
    library: Mapping[str, Signature] | None,
    graphs: Container[str] = frozenset(),
) -> None:
    """Report in `subject` all problems of parameters and their values. `library`: the actions that
    the engine has, by name, or None if unknown. `graphs`: names of sub-graphs, which need not be in
    the library."""
    inputs = {action.key: slots_of(action.inputs) for action in subject.real}
    outputs = {action.key: slots_of(action.outputs) for action in subject.real}
    for relation in subject.sound:
        _check_remap(subject, relation, inputs, outputs)
    for action in subject.real:
        _check_inputs(subject, action, inputs, outputs, library)
        _check_static(subject, action, inputs[action.key])
        if library is not None:
            _check_known(subject, action, library, inputs[action.key], outputs[action.key], graphs)


_Slots = dict[str, Slot]


def _check_remap(
    subject: Subject,
    relation: Relation,
    inputs: Mapping[Key, _Slots],
    outputs: Mapping[Key, _Slots],
) -> None:
    if not relation.remap or relation.child == EXIT:
        return
    targets = inputs[relation.child]
    own = {} if relation.parent == ENTRY else outputs[relation.parent]
    unknown = {remap.source for remap in relation.remap} - set(own)
    if unknown and relation.parent != ENTRY:
        message = (
            f"{subject.name(relation.parent)} has no output {joined(unknown)} to rename: when it "
            "ends, the engine aborts with every running graph."
        )
        subject.report("H2", "error", message, relation=relation, member="/remap")
        return
    useless = {remap.target for remap in relation.remap} - set(targets)
    if useless:
        child = subject.name(relation.child)
        message = f"{child} has no input {joined(useless)}; what is renamed to it is lost."
        subject.report("remap-target", "warning", message, relation=relation, member="/remap")
    if relation.parent != ENTRY:
        _check_order(subject, relation, own, targets)


def _check_order(subject: Subject, relation: Relation, own: _Slots, targets: _Slots) -> None:
    """Report a renaming on an arrow (`relation`) that changes the order in which the engine
    searches for outputs, so that it does not find some. `own`: the outputs of the parent;
    `targets`: the inputs of the child."""
    parent, child = subject.name(relation.parent), subject.name(relation.child)
    meant = {name: name for name in own} | {r.source: r.target for r in relation.remap}
    try:
        found = renamed(own, relation.remap, targets)
    except RemapUnknown as e:
        message = (
            f"The first renamings change the alphabetical order of {parent}'s outputs, in which the "
            f"engine then does not find “{e}”: when {parent} ends, it aborts with every running graph."
        )
        subject.report("H2", "error", message, relation=relation, member="/remap")
        return
    lost = set(meant.values()) & set(targets) - set(found)
    if lost:
        message = (
            f"This renaming changes the alphabetical order of {parent}'s outputs, in which the "
            f"engine then cannot find {joined(lost)} any more: {child} does not get it."
        )
        needed = any(targets[n].required and not targets[n].has_value() for n in lost)
        severity: Severity = "error" if needed else "warning"
        subject.report("remap-order", severity, message, relation=relation, member="/remap")


def _check_inputs(
    subject: Subject,
    action: Action,
    inputs: Mapping[Key, _Slots],
    outputs: Mapping[Key, _Slots],
    library: Mapping[str, Signature] | None,
) -> None:
    """Report required inputs of an action that have no value in the file and get none that fits by
    an arrow. `inputs`, `outputs`: the parameters of all actions, by key; `library`: as in
    `check_values`."""
    known = (library or {}).get(action.name)
    incoming = subject.incoming.get(action.key, [])
    needed = {
        name: slot
        for name, slot in inputs[action.key].items()
        if slot.required and not slot.has_value() and not (known and name in known.optional)
    }
    is_entry = any(relation.parent == ENTRY for relation in incoming)
    given = {} if is_entry or not needed else _given_kinds(incoming, outputs, needed)
    for name, slot in needed.items():
        member = f"/input_parameters/{subject.path_of(action, name)}"
        fix = subject.fix_of_input(action, name)
        if is_entry:
            message = (
                f"{action.full_name} is an entry and its input “{name}” has no value: the engine "
                "silently never starts the graph, and says nothing. (As a sub-graph it may get one.)"
            )
            subject.report("H7", "error", message, action=action, member=member, fix=fix)
            continue
        kinds = given.get(name, set())
        if incoming and slot.type not in kinds:
            wrong = " The type of what a parent hands over differs." if kinds else ""
            message = (
                f"Nobody gives {action.full_name} its input “{name}”: it never runs and the graph "
                f"stays RUNNING for ever.{wrong}"
            )
            subject.report("H8", "error", message, action=action, member=member, fix=fix)


def _given_kinds(
    incoming: list[Relation], outputs: Mapping[Key, _Slots], needed: _Slots
) -> dict[str, set[str]]:
    """Return, for each input in `needed` that is not locked, the types of the outputs that the
    arrows `incoming` hand over to it. `outputs`: those of all actions, by key."""
    open_ = {name: slot for name, slot in needed.items() if slot.updatable}
    kinds: dict[str, set[str]] = {}
    for relation in incoming if open_ else []:
        own = outputs[relation.parent]
        try:
            places = renamed(own, relation.remap, open_)
        except RemapUnknown:
            continue
        for name, place in places.items():
            kinds.setdefault(name, set()).add(own[place].type)
    return kinds


def check_static(subject: Subject) -> None:
    """Report in `subject` each value that is not among the allowed values of its parameter."""
    for action in subject.real:
        _check_static(subject, action, slots_of(action.inputs))


def _check_static(subject: Subject, action: Action, inputs: _Slots) -> None:
    for name, slot in inputs.items():
        if slot.has_value() and slot.allowed and slot.value not in slot.allowed:
            message = (
                f"The value of “{name}” is none of the allowed ones; the engine does not notice."
            )
            member = f"/input_parameters/{subject.path_of(action, name)}/pvf_value"
            subject.report("parameter-allowed", "warning", message, action=action, member=member)


def _check_known(
    subject: Subject,
    action: Action,
    library: Mapping[str, Signature],
    inputs: _Slots,
    outputs: _Slots,
    graphs: Container[str],
) -> None:
    known = library.get(action.name)
    if known is not None:
        check_signature(subject, action, known, inputs, outputs)
    elif action.name not in graphs:
        message = f"No library knows the action “{action.name}”; the engine refuses the graph unless it does."
        subject.report("unknown-action", "warning", message, action=action, member="/name")


def check_signature(
    subject: Subject, action: Action, known: Signature, inputs: _Slots, outputs: _Slots
) -> None:
    """Report the parameters in which an action (with these `inputs` and `outputs`) differs from
    `known`, the library action or sub-graph that it stands for."""
    for side, ours, theirs in (("input", inputs, known.inputs), ("output", outputs, known.outputs)):
        surplus, lacking = set(ours) - set(theirs), set(theirs) - set(ours)
        if surplus or lacking:
            what = "".join(
                f" {verb} {joined(names)}."
                for verb, names in (("It does not know", surplus), ("It wants", lacking))
                if names
            )
            message = (
                f"The {side}s of {action.full_name} are not those of its action, so the engine cannot "
                f"resolve the graph.{what}"
            )
            member = f"/{side}_parameters"
            subject.report("signature", "error", message, action=action, member=member)
        for name in sorted(set(ours) & set(theirs)):
            if ours[name].type != theirs[name]:
                message = (
                    f"“{name}” is a {ours[name].type} here and a {theirs[name]} in the action: "
                    "the action ends in ERROR."
                )
                member = f"/{side}_parameters/{subject.path_of(action, name)}"
                subject.report("parameter-type", "error", message, action=action, member=member)
