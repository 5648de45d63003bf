"""How full a document is: what it may hold, and who is told when it is more.

Both limits are looked at before an update is applied, and counted anew only when what was added
since could have reached them: counting is slow. Deletions are always taken, so that a full graph can
be made smaller. What is brought back after it was deleted is not counted as new; the bytes bound it.
"""

from typing import Any, Final

from pycrdt import Doc, Map

from action_assistant.editor.scan import Outline

MOST_ACTIONS: Final = 5_000
MOST_BYTES: Final = 32 << 20
_WORTH: Final = 1 << 20  # bytes added since, for which measuring again is worth its time


class Full(Exception):
    """The document would hold more than one may; the message says of what."""


class Fullness:
    """The bounds of one document: never below what it holds."""

    def __init__(self, doc: "Doc[Any]") -> None:
        self._doc = doc
        self._bytes = 0
        self._measured = 0
        self._spare = 0
        self._changed = True  # since actions were counted

    def check(self, update: bytes, read: Outline) -> None:
        """Raises Full for an update that brings too much. Only deletions never do."""
        if read.actions > self._spare and self._changed:
            self._changed = False
            self._spare = MOST_ACTIONS - actions_in(self._doc)
        if read.actions > max(self._spare, 0):
            raise Full(f"a graph may have {MOST_ACTIONS:,} actions")
        if read.brings and self._bytes + len(update) > MOST_BYTES:
            if self._bytes - self._measured >= _WORTH:
                self._bytes = self._measured = len(self._doc.get_update())
            if self._bytes + len(update) > MOST_BYTES:
                raise Full(f"a graph may have {MOST_BYTES >> 20} MiB")

    def took(self, size: int, actions: int = 0) -> None:
        """So many bytes were applied, with so many new actions in them."""
        self._bytes += size
        self._spare -= actions
        self._changed = True


def actions_in(doc: "Doc[Any]") -> int:
    """How many actions a document has: their keys are those without a field."""
    return sum("|" not in key for key in doc.get("actions", type=Map).keys())  # noqa: SIM118
