"""Tells a process that the one that started it has ended, for whatever reason: a pipe between them
closes then.

A process that starts others keeps the writing end of a pipe open, passes the reading end on, and
names it in the environment.
"""

import os
import threading
from collections.abc import Callable
from typing import Final

#: The environment variable with the descriptor of the reading end.
PARENT: Final = "_ACTION_ASSISTANT_PARENT"


def pipe_of_parent() -> int | None:
    """Return the reading end of the pipe, and forget it, so that processes started by this one do
    not take it for theirs. Return None if nobody has passed one on."""
    descriptor = os.environ.pop(PARENT, None)
    return None if descriptor is None else int(descriptor)


def when_parent_ends(end: Callable[[], object]) -> None:
    """Call `end` on a daemon thread once the parent has ended. Do nothing if it has passed no pipe
    on."""
    descriptor = pipe_of_parent()
    if descriptor is None:
        return

    def wait() -> None:
        with os.fdopen(descriptor, "rb") as pipe:
            pipe.read()
        end()

    threading.Thread(target=wait, name="parent", daemon=True).start()
