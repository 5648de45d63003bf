"""The quota of a document: how many actions, fields and bytes it may hold.

Both limits are looked at before an update is applied, and counted anew only when what was added
since could have reached them: counting is slow. Deletions are always taken, so that a full graph can
be made smaller. What is brought back after it was deleted is not counted as new; the bytes bound it.
"""

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from pycrdt import Doc, Map

from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.documents.values import ROOTS
from action_assistant.errors import TooLarge
from action_assistant.settings import load_limits
from action_assistant.umrf.model import ENTRY, EXIT, Graph

#: No setting allows more (decision 20); ACTION_ASSISTANT_LIMITS allows less.
MOST_ACTIONS: Final = 5_000
MOST_BYTES: Final = 32 << 20
_WORTH: Final = 1 << 20  # bytes added since, for which measuring again is worth its time


#: Keys of the shared maps that a graph may come with: each is a struct of its first update.
MOST_FIELDS: Final = 200_000
MOST_ARROWS: Final = 20_000
#: Arrows of one action on one side: as many as there can be others.
MOST_AT_ONE: Final = MOST_ACTIONS


def _most_actions() -> int:
    return min(MOST_ACTIONS, load_limits().actions)


def _most_bytes() -> int:
    return min(MOST_BYTES, load_limits().graph_mib << 20)


def refuse_too_much(graph: Graph, dialect: str) -> None:
    """Raise TooLarge, with the place in the file, if a graph has more actions or arrows than a
    document may have. `dialect`: the dialect of the file."""
    actions = "/umrf_actions" if dialect in {"D1", "D1'"} else "/actions"
    real = [action for action in graph.actions if not action.missing]
    if len(graph.actions) > (most := _most_actions()):
        ghosts = len(graph.actions) - len(real)
        told = f", {ghosts:,} of them only named by arrows" if ghosts else ""
        raise TooLarge(
            f"A graph may have {most:,} actions; this one has {len(graph.actions):,}{told}.",
            where={"path": actions},
        )
    if len(graph.relations) > MOST_ARROWS:
        raise TooLarge(
            f"A graph may have {MOST_ARROWS:,} arrows; this one has {len(graph.relations):,}.",
            where={"path": actions},
        )
    places = {action.key: f"{actions}/{n}" for n, action in enumerate(real)}
    for side, ends in (
        ("children", Counter(relation.parent for relation in graph.relations)),
        ("parents", Counter(relation.child for relation in graph.relations)),
    ):
        for key, count in ends.items():
            if count > MOST_AT_ONE:
                end = {ENTRY: "/graph_entry", EXIT: "/graph_exit"}
                place = end.get(key) or f"{places.get(key, actions)}/{side}"
                raise TooLarge(
                    f"An action may have {MOST_AT_ONE:,} {side}; here are {count:,}.",
                    where={"path": place},
                )


def refuse_too_wide(maps: Mapping[str, Mapping[str, object]]) -> None:
    """Raise TooLarge if the root maps of a document have too many keys together (MOST_FIELDS)."""
    fields = sum(map(len, maps.values()))
    if fields > MOST_FIELDS:
        raise TooLarge(
            f"A graph may have {MOST_FIELDS:,} fields, those of parameters and arrows among them; "
            f"this one has {fields:,}.",
            where={"path": ""},
        )


def refuse_too_long(update: bytes) -> None:
    """Raise TooLarge if an encoded document (`update`) is too large for a room."""
    if len(update) > (most := _most_bytes()):
        raise TooLarge(f"A graph may have {most >> 20} MiB.", where={"path": ""})


class QuotaExceeded(Exception):
    """The document would exceed a limit, which the message names."""


class DocumentQuota:
    """The limits of one document: bytes, actions and fields. A document that is larger already may
    stay so, but not grow."""

    def __init__(self, doc: "Doc[Any]") -> None:
        self._doc = doc
        self._most_actions = _most_actions()
        self._most_bytes = _most_bytes()
        self._bytes = 0
        self._measured = 0
        self._spare = 0
        self._spare_fields = 0
        self._fields_changed = True
        self._changed = True  # since actions were counted

    def check(self, update: bytes, read: UpdateOutline) -> None:
        """Raise QuotaExceeded if the document would have too many actions, fields or bytes after
        this update. `read`: its outline. An update that only deletes is always accepted."""
        if read.actions > self._spare and self._changed:
            self._changed = False
            self._spare = self._most_actions - actions_in(self._doc)
        if read.actions > max(self._spare, 0):
            raise QuotaExceeded(f"a graph may have {self._most_actions:,} actions")
        if read.fields > self._spare_fields and self._fields_changed:
            self._fields_changed = False
            self._spare_fields = MOST_FIELDS - fields_in(self._doc)
        if read.fields > max(self._spare_fields, 0):
            raise QuotaExceeded(f"a graph may have {MOST_FIELDS:,} fields")
        if read.brings and self._bytes + len(update) > self._most_bytes:
            if self._bytes - self._measured >= _WORTH:
                self._bytes = self._measured = len(self._doc.get_update())
            if self._bytes + len(update) > self._most_bytes:
                raise QuotaExceeded(f"a graph may have {self._most_bytes >> 20} MiB")

    def took(self, size: int, actions: int = 0, fields: int = 0) -> None:
        """Count an update that was applied: its `size` in bytes, and the numbers of new actions and
        fields in it."""
        self._bytes += size
        self._spare -= actions
        self._spare_fields -= fields
        self._changed = self._fields_changed = True


def actions_in(doc: "Doc[Any]") -> int:
    """Return the number of actions in a document: the keys without a field name in its map of
    actions."""
    return sum("|" not in key for key in doc.get("actions", type=Map).keys())  # noqa: SIM118


def fields_in(doc: "Doc[Any]") -> int:
    """Return the number of keys in all root maps of a document."""
    return sum(len(doc.get(root, type=Map)) for root in ROOTS)
