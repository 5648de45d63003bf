"""Calls of the CRDT library with foreign bytes: their failures, and a short way for updates."""

from contextlib import AbstractContextManager
from typing import Any, Final

from pycrdt import Doc

from action_assistant.editor.crdt.messages import Malformed


class Panicked(Exception):
    """The CRDT library panicked over an update; the document may be damaged."""


class _Applying:
    """Tells the failures of the CRDT library from all others. Holds nothing: one serves for all."""

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
    """Around a call of the CRDT library with foreign bytes, and nothing else. Raises Malformed,
    Panicked."""
    return _APPLYING


def apply_updates(doc: "Doc[Any]", *updates: bytes) -> None:
    """As `doc.apply_update(update)` for each, in one transaction, where none is under way; what observers raise
    is not told. In a busy editor the library's layer of Python is a twentieth of all that an edit costs, more
    than the change itself, and a quarter of what many cost together."""
    core = doc._doc  # noqa: SLF001 - no public way is as short; tests hold both to be the same
    transaction = core.create_transaction()
    try:
        for update in updates:
            core.apply_update(transaction, update)
    finally:
        transaction.commit()
        transaction.drop()
