"""Changes of a graph in words: what differs between two moments, one sentence each."""

from collections.abc import Iterable, Mapping
from typing import Any, Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.difference import Difference, Field, difference
from action_assistant.umrf.model import Graph

Subject: TypeAlias = Literal["graph", "action", "arrow", "note", "comment"]

_LONGEST: Final = 120  # characters of a value


class GraphChange(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One difference. `name`: the full name of an action (the newer one), or the id of a note or
    comment; `before` and `after` are None if there was or is no value."""

    subject: Subject
    change: Literal["added", "removed", "changed"]
    words: str
    name: str = ""
    parent: str = ""
    child: str = ""
    field: str = ""
    before: Any = None
    after: Any = None


class ShownGraph(msgspec.Struct, frozen=True):
    """A graph and its comments."""

    graph: Graph
    comments: Mapping[str, object]


def changes(before: ShownGraph, after: ShownGraph) -> list[GraphChange]:
    """Return the differences between two states, one sentence each. A difference without a sentence
    of its own, for example of an order, is described as a change of the graph."""
    found = [
        *_of_graph(difference((0, before.graph), (0, after.graph))),
        *_of_texts("note", dict(before.graph.notes), dict(after.graph.notes)),
        *_of_texts("comment", before.comments, after.comments),
    ]
    if not found and before != after:
        found.append(GraphChange(subject="graph", change="changed", words="the graph changed"))
    return found


def _of_graph(different: Difference) -> Iterable[GraphChange]:
    for field in different.fields:
        yield _field("graph", "graph", field)
    for action in sorted(different.actions, key=lambda each: (each.name, each.aid)):
        words = f"action {action.name}"
        if action.change != "changed":
            yield GraphChange(
                subject="action",
                change=action.change,
                words=f"{words} {action.change}",
                name=action.name,
            )
        for field in action.fields:
            yield _field("action", words, field, name=action.name)
    for arrow in different.relations:
        words = f"arrow {arrow.parent} → {arrow.child}"
        ends = {"parent": arrow.parent, "child": arrow.child}
        if arrow.change != "changed":
            yield GraphChange(
                subject="arrow", change=arrow.change, words=f"{words} {arrow.change}", **ends
            )
        for field in arrow.fields:
            yield _field("arrow", words, field, **ends)


def _of_texts(
    subject: Subject, before: Mapping[str, object], after: Mapping[str, object]
) -> Iterable[GraphChange]:
    for name in sorted(before.keys() | after.keys()):
        if before.get(name) == after.get(name):
            continue
        change: Literal["added", "removed", "changed"] = (
            "added" if name not in before else "removed" if name not in after else "changed"
        )
        yield GraphChange(
            subject=subject,
            change=change,
            words=f"{subject} {change}",
            name=name,
            before=before.get(name),
            after=after.get(name),
        )


def _field(subject: Subject, who: str, field: Field, **ends: str) -> GraphChange:
    return GraphChange(
        subject=subject,
        change="changed",
        words=_field_words(subject, who, field),
        field=field.field,
        before=field.before,
        after=field.after,
        **ends,
    )


def _field_words(subject: Subject, who: str, field: Field) -> str:
    before, after = _shown(field.before), _shown(field.after)
    match subject, field.field:
        case "action", "position":
            return f"{who} moved"
        case "action", "name":
            return f"action {before} renamed to {after}"
        case "graph", "name":
            return f"graph {before} renamed to {after}"
    if subject == "arrow" and field.field.startswith("waypoints/"):
        return f"{who} {'straightened' if field.after is None else 'bent'}"
    name = field.field.removeprefix("in/")
    if subject == "action" and field.field.startswith("in/"):
        name = f"parameter {name}"
    elif subject == "action" and field.field.startswith("out/"):
        name = f"output {field.field.removeprefix('out/')}"
    if field.after is None:
        return f"{who}: {name} removed (was {before})"
    if field.before is None:
        return f"{who}: {name} added: {after}"
    return f"{who}: {name} is {after} (was {before})"


def _shown(value: object) -> str:
    """Return a value as text, shortened to fit into a line."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = value if isinstance(value, str) else str(value)
    if not text:
        return "empty"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
