"""Waypoints of arrows in files, by the names of the actions, since a file need not have their keys.

`gui_attributes.action_assistant.waypoints` of the graph is a list of `{parent, child, response,
points}` (docs/decisions/052-waypoints.md). `parent` and `child` are full names, or `entry` and
`exit`. `listing` numbers the relations of the same two names from 0, and is present if it is not 0.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import TypeAlias

from msgspec.structs import replace

from action_assistant.umrf.json.text import Json, Number, dump, parse_small
from action_assistant.umrf.model import ENTRY, EXIT, RESPONSES, Graph, JsonText, Relation, Response

#: The full names of both ends, and the number of the relation between them.
_Name: TypeAlias = tuple[str, str, int]


def waypoints_json(graph: Graph) -> list[Json]:
    """Return the waypoints of a graph as its file has them, in the order of its actions."""
    if not any(relation.waypoints for relation in graph.relations):
        return []
    items: list[Json] = []
    for (parent, child, listing), relation in _named(graph):
        for response, text in relation.waypoints:
            item: dict[str, Json] = {"parent": parent, "child": child, "response": response}
            if listing:
                item["listing"] = Number(str(listing))
            items.append({**item, "points": parse_small(text)})
    return items


def with_waypoints(graph: Graph, items: Json) -> Graph:
    """Return the graph with the waypoints of its arrows, as its file lists them in `items`.
    Waypoints that fit no relation are dropped; if `items` is no list, all of them."""
    if not isinstance(items, list):
        return graph
    by_name: dict[_Name, dict[str, JsonText]] = defaultdict(dict)
    for item in items:
        if isinstance(item, dict) and "points" in item:
            by_name[_name_in(item)][str(item.get("response"))] = dump(item["points"])
    found = {
        id(relation): tuple(_in_order(by_name[name]))
        for name, relation in _named(graph)
        if name in by_name
    }
    relations = tuple(
        replace(relation, waypoints=found[id(relation)]) if id(relation) in found else relation
        for relation in graph.relations
    )
    return replace(graph, relations=relations)


def _in_order(texts: dict[str, JsonText]) -> Iterable[tuple[Response, JsonText]]:
    return ((response, texts[response]) for response in RESPONSES if response in texts)


def _name_in(item: dict[str, Json]) -> _Name:
    listing = item.get("listing")
    whole = isinstance(listing, Number) and listing.value.is_integer()
    count = int(listing.value) if isinstance(listing, Number) and whole else 0
    return str(item.get("parent")), str(item.get("child")), count


def _named(graph: Graph) -> Iterable[tuple[_Name, Relation]]:
    """Yield the relations of a graph, each with the names of its ends and its number among those
    between them, in the order of the actions."""
    names = {ENTRY: ENTRY, EXIT: EXIT} | {a.key: a.full_name for a in graph.actions}
    order = {key: place for place, key in enumerate(names)}
    known = [r for r in graph.relations if r.parent in names and r.child in names]
    counts: dict[tuple[str, str], int] = defaultdict(int)
    for relation in sorted(known, key=lambda r: (order[r.parent], order[r.child], r.listing)):
        ends = names[relation.parent], names[relation.child]
        yield (*ends, counts[ends]), relation
        counts[ends] += 1
