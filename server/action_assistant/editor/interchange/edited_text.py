"""Compares the edited text of a graph with its document, key by key, and merges it.

A person edits the canonical text of one moment. Here it is read, its actions are told apart from
those of the moment, and what differs is answered key by key. The page applies it, so that it is an
edit of the person's own, which undo takes back; `before` lets it see what others changed meanwhile.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final, TypeAlias

import msgspec
from msgspec import UNSET, UnsetType
from msgspec.structs import replace

from action_assistant.editor.documents import document
from action_assistant.editor.documents.contents import (
    NOTHING_INSIDE,
    GraphAtSeq,
    Inside,
    ReadGraph,
    graphs_of,
    maps_of,
    read,
)
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.documents.values import ends_of, is_aid, number
from action_assistant.editor.interchange import importing
from action_assistant.editor.interchange.document_edits import chosen, setting
from action_assistant.errors import NotUmrf
from action_assistant.umrf.check import check
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.places import places_of, pointer
from action_assistant.umrf.model import Action, Graph, Key, Problem

_ORDERS: Final = ("order", "po", "co")
#: A field that no text has: it stays with its action or relation.
_BREAKPOINT: Final = "breakpoint"
_WORSE: Final = 20  # problems that are told
_Wanted: TypeAlias = dict[tuple[str, str], object]


class KeyChange(msgspec.Struct, frozen=True):
    """The change of one key of the document. A missing `before` or `after` means that the key has
    no value."""

    root: str
    key: str
    before: object | UnsetType = UNSET
    after: object | UnsetType = UNSET


class TextEdit(msgspec.Struct, frozen=True):
    """The changes that an edited text makes to the graph after the change `seq`, and the new
    errors, with their places in the text."""

    seq: int
    changes: tuple[KeyChange, ...]
    problems: tuple[Problem, ...]


def edited_text(sight: GraphAtSeq, text: bytes, inside: Inside) -> bytes:
    """Compare an edited text with the graph it was edited from (`sight`); return the JSON of a
    `TextEdit`. Call it in a worker process. Raise the errors of `text_edit`."""
    found = read(sight)
    return msgspec.json.encode(text_edit(found.moment, text, found.problems(inside), inside))


def text_edit(
    moment: ReadGraph,
    text: bytes,
    known: Iterable[Problem] = (),
    inside: Inside = NOTHING_INSIDE,
) -> TextEdit:
    """Compare `text`, edited from the canonical text of `moment`, with its graph, and return the
    changes. `known`: the present problems of the graph, with the graphs `inside`. Raise BadInput,
    NotUmrf or TooLarge, with the place, for a text that cannot be read."""
    shown = codec.read(codec.write(moment.graph))
    wanted = importing.read(text)
    _refuse(shown, wanted)
    old = _under_keys(shown.graph, _keys_of(moment.graph, shown.graph))
    new = _under_keys(wanted.graph, _aligned(old, wanted.graph))
    _refuse_ghosts(old, new, wanted.text)
    changes = tuple(key_changes(moment.maps, old, new))
    worse = wanted.placed(_worse(known, new, inside)) if changes else []
    return TextEdit(moment.seq, changes, tuple(worse))


def _refuse(shown: codec.Reading, wanted: codec.Reading) -> None:
    """Raise NotUmrf for an edited text (`wanted`) from which an import would drop or assume
    something, unless the original (`shown`) had that problem already."""
    if wanted.dialect != "D3":
        raise NotUmrf(
            f"This reads as an older form of UMRF ({wanted.dialect}). Import it as a graph of its "
            "own."
        )
    known = {(problem.code, problem.message) for problem in shown.problems}
    for problem in wanted.problems:
        if (problem.code, problem.message) not in known:
            raise NotUmrf(problem.message, where=_place(wanted.text, problem.where.path))


def _worse(known: Iterable[Problem], new: Graph, inside: Inside) -> tuple[Problem, ...]:
    """Return the errors that the edited graph (`new`) has and the original had not (`known`: its
    problems), the first ones only."""
    old = {(problem.code, problem.message) for problem in known}
    found = check(new, graphs=graphs_of(inside), resolution=inside.resolution)
    errors = [problem for problem in found if problem.severity == "error"]
    return tuple(p for p in errors if (p.code, p.message) not in old)[:_WORSE]


# Matching actions


def _real(graph: Graph) -> list[Action]:
    return [action for action in graph.actions if not action.missing]


def _keys_of(moment: Graph, shown: Graph) -> dict[Key, Key]:
    """Return the original key, in `moment`, of each action of `shown`, the same graph written and
    read again: actions by index, ghosts by name."""
    pairs = zip(_real(shown), _real(moment), strict=True)
    keys = {copy.key: action.key for copy, action in pairs}
    ghosts = {action.full_name: action.key for action in moment.actions if action.missing}
    for action in shown.actions:
        if action.missing:
            keys[action.key] = ghosts.get(action.full_name) or document.new_aid()
    return keys


def _aligned(old: Graph, wanted: Graph) -> dict[Key, Key]:
    """Return the keys for the actions of the edited graph: the key of the action of `old` with the
    same full name, else of the renamed action at the same position between its neighbours, else a
    new one."""
    free: dict[tuple[str, bool], list[Key]] = defaultdict(list)
    for action in old.actions:
        free[action.full_name, action.missing].append(action.key)
    keys: dict[Key, Key] = {}
    for action in wanted.actions:
        if same := free[action.full_name, action.missing]:
            keys[action.key] = same.pop(0)
    kept = set(keys.values())
    gone = _gaps([action.key for action in _real(old)], kept)
    fresh = _gaps([keys.get(a.key, a.key) for a in _real(wanted)], kept)
    for after, names in fresh.items():
        keys.update(zip(names, gone.get(after, []), strict=False))
    return {a.key: keys.get(a.key) or document.new_aid() for a in wanted.actions}


def _gaps(order: Sequence[Key], kept: set[Key]) -> dict[Key, list[Key]]:
    """Return the keys in `order` that are not in `kept`, grouped by the key of `kept` before them;
    "" stands for the beginning."""
    found: dict[Key, list[Key]] = defaultdict(list)
    last = ""
    for key in order:
        if key in kept:
            last = key
        else:
            found[last].append(key)
    return found


def _under_keys(graph: Graph, keys: Mapping[Key, Key]) -> Graph:
    actions = tuple(replace(action, key=keys[action.key]) for action in graph.actions)
    relations = tuple(
        replace(r, parent=keys.get(r.parent, r.parent), child=keys.get(r.child, r.child))
        for r in graph.relations
    )
    return replace(graph, actions=actions, relations=relations)


def _refuse_ghosts(old: Graph, new: Graph, text: str) -> None:
    """Raise NotUmrf, with the place in `text`, for a new arrow to an action that does not exist,
    most often half of a renaming."""
    known = {action.full_name for action in old.actions if action.missing}
    for action in new.actions:
        if action.missing and action.full_name not in known:
            message = f"There is no action {action.name} with the number {action.instance_id}."
            path = _naming(msgspec.json.decode(text.encode()), action)
            raise NotUmrf(message, where=_place(text, path))


def _place(text: str, path: str) -> dict[str, object] | None:
    """Return the place (pointer, line, column) of the JSON pointer `path` in a text, for a refusal;
    None for the whole text."""
    found = places_of(text, [path])[path]
    place: dict[str, object] = {"path": found.path, "line": found.line, "column": found.column}
    return place if found.path else None


def _naming(file: object, ghost: Action) -> str:
    """Return the JSON pointer at which a parsed file first names the missing action `ghost` in a
    list of relations."""
    if not isinstance(file, dict):
        return ""
    lists: list[tuple[tuple[str | int, ...], object]] = [
        ((end,), file.get(end)) for end in ("graph_entry", "graph_exit")
    ]
    actions = file.get("actions")
    for i, action in enumerate(actions if isinstance(actions, list) else []):
        for side in ("parents", "children"):
            found = action.get(side) if isinstance(action, dict) else None
            lists.append((("actions", i, side), found))
    for place, items in lists:
        for i, item in enumerate(items if isinstance(items, list) else []):
            if not isinstance(item, dict) or item.get("name") != ghost.name:
                continue
            if item.get("instance_id", 0) == ghost.instance_id:
                return pointer(*place, i)
    return ""


# Comparing


def key_changes(maps: Maps, old: Graph, new: Graph) -> list[KeyChange]:
    """Return the changes of keys that make a document with the root maps `maps`, which shows the
    graph `old`, show `new`."""
    wanted = _fields(old, new) | _orders(maps, old, new) | _leftovers(maps, old, new)
    changes = []
    for (root, key), after in sorted(wanted.items(), key=lambda item: item[0]):
        before = maps.get(root, {}).get(key, UNSET)
        if before is UNSET and after is UNSET:
            continue
        if before != after or isinstance(before, bool) != isinstance(after, bool):
            changes.append(KeyChange(root, key, before, after))
    return changes


def _fields(old: Graph, new: Graph) -> _Wanted:
    """Return the entries whose values differ between the graphs `old` and `new` (UNSET: removed),
    without entries that store an order."""
    before, after = document.flatten(old), document.flatten(new)
    wanted: _Wanted = {}
    for root, fields in after.items():
        for key in before[root].keys() - fields.keys():
            if key.partition("|")[2] != _BREAKPOINT or root == "meta":
                wanted[root, key] = UNSET
        for key, value in fields.items():
            if key.rpartition("|")[2] in _ORDERS and not key.startswith("x/"):
                continue
            if key not in before[root] or before[root][key] != value:
                wanted[root, key] = value
    return wanted


def _leftovers(maps: Maps, old: Graph, new: Graph) -> _Wanted:
    """Return the remaining entries in `maps` of actions and relations that `new` lacks, to be
    removed."""
    gone = {action.key for action in old.actions} - {action.key for action in new.actions}
    there = {f"{r.parent}>{r.child};{r.listing}" for r in new.relations}
    lost = {f"{r.parent}>{r.child};{r.listing}" for r in old.relations} - there
    wanted: _Wanted = {}
    for root in ("actions", "positions"):
        for key in maps.get(root, {}):
            if key.partition("|")[0] in gone:
                wanted[root, key] = UNSET
    for root, prefix in (("relations", ""), ("positions", "w/")):
        for key in maps.get(root, {}):
            ends = ends_of(key.removeprefix(prefix).partition("|")[0])
            if ends and f"{ends.parent}>{ends.child};{ends.listing}" in lost:
                wanted[root, key] = UNSET
    return wanted


def _orders(maps: Maps, old: Graph, new: Graph) -> _Wanted:
    """Return order numbers for the actions and relations of `new` that are new or moved, between
    the numbers of their neighbours."""
    wanted: _Wanted = {}
    lists = [("actions", "order", _by_place(old), _by_place(new))]
    before, after = _by_end(old), _by_end(new)
    lists += [
        ("relations", field, before.get((field, end), []), ids)
        for (field, end), ids in after.items()
    ]
    for root, field, was, now in lists:
        fields = maps.get(root, {})
        numbers = {head: number(fields.get(f"{head}|{field}")) or 0.0 for head in was}
        for head, value in _numbered(was, now, numbers).items():
            wanted[root, f"{head}|{field}"] = value
    return wanted


def _by_place(graph: Graph) -> list[str]:
    return [action.key for action in graph.actions if is_aid(action.key)]


def _by_end(graph: Graph) -> dict[tuple[str, Key], list[str]]:
    """Return the ids of the relations at each action, in their order: as the parent under (`po`,
    key), as the child under (`co`, key)."""
    flat = document.flatten(graph)["relations"]
    found: dict[tuple[str, Key], list[tuple[float, str]]] = defaultdict(list)
    for key, value in flat.items():
        head, _, field = key.partition("|")
        ends = ends_of(head)
        if ends is not None and field in ("po", "co"):
            end = ends.parent if field == "po" else ends.child
            found[field, end].append((number(value) or 0.0, head))
    return {place: [head for _, head in sorted(items)] for place, items in found.items()}


def _numbered(
    was: Sequence[str], now: Sequence[str], numbers: Mapping[str, float]
) -> dict[str, float]:
    """Return the numbers that have to change so that sorting by number gives the order `now`. Items
    are named by the beginning of their keys. `was` is the order before, `numbers` the number of
    each item. The result is empty if no number has to change. If the items in both orders keep
    their relative order, they keep their numbers, and only new ones get numbers in between;
    otherwise every item gets a new number."""
    kept = [head for head in now if head in numbers]
    there = set(now)
    if kept == [head for head in was if head in there]:
        if len(kept) == len(now):
            return {}
        values = [numbers[head] for head in kept]
        if all(a < b for a, b in pairwise(values)):
            return _between(now, numbers)
    return {head: float(i) for i, head in enumerate(now)}


def _between(now: Sequence[str], numbers: Mapping[str, float]) -> dict[str, float]:
    """Return numbers for the items of `now` that have no number yet, evenly spaced between the
    numbers of their neighbours."""
    found: dict[str, float] = {}
    run: list[str] = []
    low: float | None = None
    for head in [*now, ""]:
        if head and head not in numbers:
            run.append(head)
            continue
        high = numbers.get(head)
        start = low if low is not None else (high if high is not None else 0.0) - len(run) - 1
        end = high if high is not None else start + len(run) + 1
        step = (end - start) / (len(run) + 1)
        found.update({new: start + step * (i + 1) for i, new in enumerate(run)})
        run, low = [], high
    return found


class MergingOutcome(msgspec.Struct, frozen=True):
    """The update that merges an edited text. `conflicts`: keys that another person has changed
    meanwhile; if there are any, the update is empty. `problems`: the new errors."""

    update: bytes
    conflicts: tuple[str, ...]
    problems: tuple[Problem, ...]


def merging(then: GraphAtSeq, state: bytes, text: bytes, inside: Inside) -> MergingOutcome:
    """Return the update that merges an edited text into a graph that may have changed since, or the
    conflicts. `then`: the state from whose text it was edited; `state`: the document now; `inside`:
    the graphs inside. Raise BadInput, NotUmrf or TooLarge, with the place, for a text that cannot
    be read."""
    found = read(then)
    edit = text_edit(found.moment, text, found.problems(inside), inside)
    now = maps_of(state)
    conflicts = tuple(each.key for each in edit.changes if _is_other(now, each))
    if conflicts:
        return MergingOutcome(b"", conflicts, edit.problems)
    targets = {(each.root, each.key): each.after for each in edit.changes}
    return MergingOutcome(setting(state, targets), (), edit.problems)


def _is_other(now: Maps, change: KeyChange) -> bool:
    """Return whether a key has, in the maps `now`, neither the value from before the edit
    (`change`) nor the wanted one."""
    value = now.get(change.root, {}).get(change.key, UNSET)
    return chosen(change.before, value, change.after) is None
