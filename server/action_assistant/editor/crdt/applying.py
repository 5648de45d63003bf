"""Calls of the CRDT library with foreign bytes: applies updates, translates errors, and checks afterwards.

The checks find what the library takes otherwise than Yjs in a page does.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any, Final

from pycrdt import Doc

from action_assistant.editor.crdt.messages import ByteReader, Malformed, number
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import cut_items

_KIND: Final = 31  # the bits of a struct that say what it is; none of them: it was collected


class Panicked(Exception):
    """The CRDT library panicked over an update; the document may be damaged."""


class _Applying:
    """Context manager that raises failures of the CRDT library as Malformed or Panicked. It has no
    state, so one instance serves all callers."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        match error:
            case None:
                return
            case ValueError() | RuntimeError():
                raise Malformed(f"not a Yjs update: {error}") from error
            case _ if type(error).__name__ == "PanicException":  # pyo3's, of BaseException
                raise Panicked(str(error)) from error


_APPLYING: Final = _Applying()


def applying() -> AbstractContextManager[None]:
    """Return the context manager for a call of the CRDT library (Yjs) with bytes from elsewhere. It
    raises Malformed for bytes that the library refuses, Panicked if the library fails."""
    return _APPLYING


def apply_updates(doc: "Doc[Any]", *updates: bytes) -> None:
    """Apply Yjs updates in one transaction, with the same result as `doc.apply_update` for each.
    The caller must have no other transaction open. Errors of observers are dropped.

    Raise ValueError or RuntimeError if the library refuses an update; the earlier ones stay
    applied. `applying` translates these errors.

    The function calls the library's core, since its Python layer costs more than the change itself.
    That saves a twentieth of the cost of an edit, and a quarter where many updates are applied
    together.
    """
    core = doc._doc  # noqa: SLF001 - no public way is as short; tests hold both to be the same
    transaction = core.create_transaction()
    try:
        for update in updates:
            core.apply_update(transaction, update)
    finally:
        transaction.commit()
        transaction.drop()


def check_cut_items(
    doc: "Doc[Any]", update: bytes, read: UpdateOutline, known: Mapping[int, int]
) -> None:
    """Raise Malformed if the document has only the first part of an item of the update, and that
    part was deleted and collected as garbage, since Yjs fails then. `read`: the outline of the
    update; `known`: per Yjs client, how many of its items the document has (its clock)."""
    if not any(start < known.get(client, 0) < end for client, start, end in read.brings):
        return
    for client in cut_items(update, known):
        clock = known[client] - 1
        reader = ByteReader(doc.get_update(_state({**known, client: clock})))
        found = [reader.number() for _ in range(4)]  # clients, structs, client, clock
        if found == [1, 1, client, clock] and not reader.byte() & _KIND:
            raise Malformed("an item that goes on from what was collected")


def check_whole(doc: "Doc[Any]", read: UpdateOutline) -> None:
    """Raise Panicked if the document lacks a part of an update that was applied: the library holds
    parts of several clients back if they wait for each other. `read`: the outline of the update."""
    if len(read.brings) > 1:
        reached = clocks(doc.get_state())
        if any(reached.get(client, 0) < end for client, _, end in read.brings):
            raise Panicked("structs that wait for each other")


def check_unchanged(doc: "Doc[Any]", known: Mapping[int, int], error: Malformed) -> None:
    """Raise Panicked if the document has changed although the library has refused an update with
    `error`. `known`: per Yjs client, how many of its items (its clock) the document had before."""
    if clocks(doc.get_state()) != {client: clock for client, clock in known.items() if clock}:
        raise Panicked(f"partly applied: {error}") from error


def clocks(state: bytes) -> dict[int, int]:
    """Decode a Yjs state vector: per client, the number of its items that a document has (its
    clock). Raise Malformed if it is cut off."""
    reader = ByteReader(state)
    return {reader.number(): reader.number() for _ in range(reader.number())}


def _state(known: Mapping[int, int]) -> bytes:
    """Encode the clocks of clients (`known`) as a Yjs state vector."""
    pairs = [number(client) + number(clock) for client, clock in known.items()]
    return number(len(pairs)) + b"".join(pairs)
