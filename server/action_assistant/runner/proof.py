"""What proves that nothing moves: a get asked after the stop, and how long a look must last."""

import hashlib
from collections.abc import Sequence
from typing import Final

import anyio
import msgspec

from action_assistant.runner.links.port import Link, NotSent
from action_assistant.runner.seen import TERMINAL, Snapshot

_REST_S: Final = 1.0  # a graph that never began is believed only after it was seen so for this long
_SEND_S: Final = 1.0


async def send_stop(link: Link, graph: str) -> str:
    """One stop message; what went wrong, if anything. Never raises."""
    try:
        with anyio.fail_after(_SEND_S):
            await link.stop(graph)
    except NotSent as why:
        return str(why) or "not sent"
    except TimeoutError:
        return "the message could not be handed over within a second"
    return ""


def hash_of(shown: Sequence[Snapshot]) -> str:
    """SHA-256 over what an answer showed, for the record of a proof."""
    return hashlib.sha256(msgspec.json.encode(list(shown))).hexdigest()


class Rest:
    """Whether a graph will not move by itself. RUNNING without a running node may be about to start
    one; one that never began has been seen between two steps of its start."""

    def __init__(self) -> None:
        self._since: float | None = None

    def forget(self) -> None:
        """It was not seen."""
        self._since = None

    def seen(self, graph: Snapshot) -> bool:
        """After one more look at the graph."""
        if graph.state in TERMINAL:
            return True
        if graph.state not in {"UNINITIALIZED", "INITIALIZED"}:
            self._since = None
            return False
        now = anyio.current_time()
        self._since = self._since if self._since is not None else now
        return now - self._since >= _REST_S
