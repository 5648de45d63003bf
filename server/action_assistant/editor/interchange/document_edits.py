"""Makes edits on a copy of a document, as updates (rule R9), and the rule of three-way merges. Runs in workers."""

from collections.abc import Callable, Mapping
from typing import Any, Literal, TypeAlias

from msgspec import UNSET
from msgspec.structs import replace
from pycrdt import Doc, Map, merge_updates

from action_assistant.editor.crdt.messages import NOTHING_NEW
from action_assistant.editor.documents import document
from action_assistant.editor.documents.contents import (
    GraphAtSeq,
    GraphInfo,
    first_action,
    info,
    maps_of,
)
from action_assistant.editor.documents.document import Maps, is_same
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.umrf.model import Graph

#: The sides of a merge: the side that is merged into, and the side that is merged.
Side: TypeAlias = Literal["ours", "theirs"]


def chosen(base: object, ours: object, theirs: object) -> Side | None:
    """Return the side of a merge whose value of a key wins; None if both sides changed it, in
    different ways. UNSET stands for no value."""
    if is_same(ours, theirs) or is_same(theirs, base):
        return "ours"
    return "theirs" if is_same(ours, base) else None


def difference(state: bytes, edit: Callable[[Doc[Any]], None]) -> bytes:
    """Call `edit` on a copy of the document with this encoded state, and return its changes as one
    update."""
    copy: Doc[Any] = Doc()
    if state:
        copy.apply_update(state)
    made: list[bytes] = []
    subscription = copy.observe(lambda event: made.append(event.update))
    try:
        edit(copy)
    finally:
        copy.unobserve(subscription)
    made = [update for update in made if update != NOTHING_NEW]
    return merge_updates(*made) if made else NOTHING_NEW


def first(graph: Graph) -> bytes:
    """Return the Yjs update that makes the document of a graph from an empty one."""
    return difference(b"", lambda doc: document.fill(doc, graph))


def drafted(then: GraphAtSeq) -> tuple[bytes, GraphInfo]:
    """Return the update that makes a new document with the content and keys of the graph `then`,
    without comments; and its facts for lists."""
    maps = {**maps_of(then.state), "comments": {}}
    update = difference(b"", lambda doc: document.change(doc, maps))
    return update, info(then)


def renaming(
    state: bytes, name: str | None, description: str | None, kind: DocumentKind = "graph"
) -> bytes:
    """Return the update that gives a graph, or (`kind`) the action of a library document, another
    name or description; None keeps the old one. `state`: the encoded document."""

    def renamed(old: Graph) -> Graph:
        action = first_action(old)
        name_now = old.name if name is None else name
        if kind == "graph" or action is None:
            told = old.description if description is None else description
            return replace(old, name=name_now, description=told)
        told = action.description if description is None else description
        new = replace(action, name=name_now, description=told)
        actions = tuple(new if each is action else each for each in old.actions)
        return replace(old, name=name_now, actions=actions)

    return editing(state, renamed)


def calling_actions(state: bytes, before: str, name: str) -> bytes:
    """Return the update of the document `state` that renames all actions called `before` to `name`
    and changes nothing else. Of actions that then share a name and an instance number, all but one
    get another number when the document is read."""

    def edit(doc: Doc[Any]) -> None:
        actions = doc.get("actions", type=Map)
        with doc.transaction():
            for action in document.read(doc).actions:
                if action.name == before and not action.missing:
                    actions[action.key] = name

    return difference(state, edit)


def editing(state: bytes, edit: Callable[[Graph], Graph]) -> bytes:
    """Return the update of the document `state` that changes its graph to the result of `edit`, and
    touches no other keys."""

    def edited(doc: Doc[Any]) -> None:
        maps = document.maps_of(doc)
        old = document.read_maps(maps)
        document.change(doc, changed(maps, old, edit(old)))

    return difference(state, edited)


def setting(state: bytes, targets: Mapping[tuple[str, str], object]) -> bytes:
    """Return the update of the document `state` that sets the keys in `targets` (root map and key)
    to these values, or removes them for UNSET, and touches no other keys."""

    def edit(doc: Doc[Any]) -> None:
        maps = document.maps_of(doc)
        for (root, key), value in targets.items():
            fields = maps.setdefault(root, {})
            fields.pop(key, None)
            if value is not UNSET:
                fields[key] = value
        document.change(doc, maps)

    return difference(state, edit)


def restoring(state: bytes, then: bytes) -> bytes:
    """Return the update that gives the document `state` the content of the document `then`;
    comments stay. Both are encoded as one update."""

    def edit(doc: Doc[Any]) -> None:
        comments = document.maps_of(doc)["comments"]
        document.change(doc, {**maps_of(then), "comments": comments})

    return difference(state, edit)


def changed(maps: Maps, old: Graph, new: Graph) -> Maps:
    """Return the root maps `maps` with the difference between the graphs `old` and `new` made in
    them; all other keys stay."""
    before, after = document.flatten(old), document.flatten(new)
    result = {root: dict(fields) for root, fields in maps.items()}
    for root, fields in after.items():
        mine = result.setdefault(root, {})
        for key in before[root].keys() - fields.keys():
            mine.pop(key, None)
        mine.update({k: v for k, v in fields.items() if before[root].get(k) != v})
    return result
