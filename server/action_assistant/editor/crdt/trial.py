"""Applies large updates to a copy in another process before the room takes them, and reads there those
of who may only look.

How long the CRDT library works on an update follows from what the update says: 80,000 values for one
key, all written at once, are 640 kB and half a minute. And some updates end the process.
"""

import contextlib
import multiprocessing
import signal
import time
from collections.abc import Iterator, Sequence
from typing import Any, Final

from pycrdt import Doc, get_update

from action_assistant.editor.crdt.applying import applying
from action_assistant.editor.crdt.messages import NOTHING_NEW, Malformed
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import outline

SECONDS: Final = 0.25  # of a processor that one update may take
_ENDS: Final = 8 * SECONDS  # of a processor, after which the process that tries it ends
OVERLONG: Final = "This change takes so long that everybody would have to wait for it"
_INSIDE: Final = 5_000  # structs of an update in which something lies inside something else


class TriedOutline(UpdateOutline, frozen=True):
    """The outline of an update that was tried; `opening`: seconds that its document took to be opened."""

    opening: float = 0.0


class TooSlow(Exception):
    """Applying this update would block the server for too long."""


def tried(state: bytes, update: bytes, released: Sequence[bytes]) -> TriedOutline:
    """Apply an update to a copy of the document `state`, and then the updates that waited for it
    (`released`); return the outline of the update and the seconds that opening the document took.
    Call it in a worker process, which ends if it takes far too long. Raise Malformed, Panicked or
    TooSlow if the update must be refused."""
    read = outline(update)
    placed = read.placed if any(each.inside for each in read.placed) else ()
    if len(placed) > _INSIDE:
        raise Malformed("too much that lies inside something else")
    doc: Doc[Any] = Doc()
    with applying():
        begun = time.process_time()
        doc.apply_update(state)
        opening = time.process_time() - begun
        begun = time.process_time()
        with _ended_after(_ENDS):
            for each in (update, *released):
                doc.apply_update(each)
        spent = time.process_time() - begun
    if spent > SECONDS:
        raise TooSlow(OVERLONG)
    return TriedOutline(
        read.brings,
        read.needs,
        placed,
        read.actions,
        read.fields,
        read.structs,
        read.paired,
        opening,
    )


def adds_nothing(state: bytes, update: bytes) -> bool:
    """Return whether an update would change nothing in a document with this state vector (what it
    has of each Yjs client). Raise Malformed or Panicked if the update cannot be read."""
    if update == NOTHING_NEW:
        return True
    outline(update)
    with applying():
        return bool(get_update(update, state) == NOTHING_NEW)


@contextlib.contextmanager
def _ended_after(seconds: float) -> Iterator[None]:
    """Return a context during which this worker process ends itself after so many seconds of
    processor time, since the library cannot be interrupted. Outside of a worker it does nothing."""
    if multiprocessing.parent_process() is None:
        yield
        return
    before = signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
