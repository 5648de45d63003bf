"""Large updates, tried on a copy of the document in another process before the room takes them.

How long the CRDT library works on an update follows from what the update says: 80,000 values for one
key, all written at once, are 640 kB and half a minute. And some updates end the process.
"""

import time
from collections.abc import Sequence
from typing import Any, Final

from pycrdt import Doc

from action_assistant.editor.replica import applying
from action_assistant.editor.scan import Outline, outline
from action_assistant.editor.wire import Malformed

SECONDS: Final = 0.25  # of a processor that one update may take
_INSIDE: Final = 5_000  # structs of an update in which something lies inside something else


class TooSlow(Exception):
    """An update that holds everybody up"""


def tried(state: bytes, update: bytes, released: Sequence[bytes]) -> Outline:
    """The outline of an update that may be applied to a document of this state, and after it the
    updates that waited for it. For workers. Raises Malformed, Panicked, TooSlow."""
    read = outline(update)
    if not any(each.inside for each in read.placed):
        read = Outline(read.brings, read.needs, (), read.actions, read.fields)
    elif len(read.placed) > _INSIDE:
        raise Malformed("too much that lies inside something else")
    doc: Doc[Any] = Doc()
    with applying():
        doc.apply_update(state)
        begun = time.process_time()
        for each in (update, *released):
            doc.apply_update(each)
        spent = time.process_time() - begun
    if spent > SECONDS:
        raise TooSlow("This change takes so long that everybody would have to wait for it")
    return read
