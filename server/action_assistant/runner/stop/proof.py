"""The proof of rest: a get asked after the stop, and for how long rest must be seen."""

import hashlib
import logging
from collections.abc import Sequence
from typing import Final

import anyio
import msgspec

from action_assistant.runner.links.observations import TERMINAL, Snapshot
from action_assistant.runner.links.port import Link, NotSent
from action_assistant.umrf.triggers import NEVER_BEGAN

log: Final = logging.getLogger(__name__)

_STARTING_S: Final = (
    0.3  # an action that has run before is not loaded again: it begins within this time
)
_AGAIN_S: Final = 2.0  # one that begins again by itself is FINISHED for a moment in between
_SEND_S: Final = 1.0
#: Commands after which a graph may move that was at rest.
SET_GOING: Final = frozenset({"start", "resume", "modify"})


async def send_stop(link: Link, graph: str) -> str:
    """One stop message; what went wrong, if anything. Never raises."""
    try:
        with anyio.fail_after(_SEND_S):
            await link.stop(graph)
    except NotSent as why:
        return str(why) or "not sent"
    except TimeoutError:
        return "the message could not be handed over within a second"
    except Exception as error:  # whatever breaks in a link, the next message has to be tried
        log.exception("a stop of %s may or may not have left", graph)
        return f"the link failed: {error!r}"
    return ""


def hash_of(shown: Sequence[Snapshot]) -> str:
    """SHA-256 over what an answer showed, for the record of a proof."""
    return hashlib.sha256(msgspec.json.encode(list(shown))).hexdigest()


class RestProof:
    """Tells whether a graph has come to rest, actions that may still be loading aside (`loading`).

    An action that has run before and was triggered again is not loaded again: what passes until the
    engine shows it RUNNING is the start of a thread. So one look is not enough: a graph must be seen at
    rest for a while. RUNNING without a running action may always be about to start one. `exact` is an
    engine that hides nothing, as the simulator.
    """

    def __init__(self, *, exact: bool) -> None:
        self._exact = exact
        self._since: float | None = None

    def forget(self) -> None:
        """It was not seen."""
        self._since = None

    @property
    def pending(self) -> bool:
        """Whether it looked at rest, but not for long enough yet."""
        return self._since is not None

    def seen(self, shown: Sequence[Snapshot], asked: float) -> bool:
        """After one more look, asked for at `asked`, at a graph and then its sub-graphs."""
        state = shown[0].state
        moving = any(each.active for each in shown)
        if moving or state not in TERMINAL | NEVER_BEGAN:
            self._since = None
            return False
        if self._exact and state in TERMINAL:
            return True
        self._since = self._since if self._since is not None else anyio.current_time()
        return asked - self._since >= _long_enough(shown)

    def missing(self, parts: Sequence[Snapshot], asked: float) -> bool:
        """After one more look, asked for at `asked`, that did not show the graph itself: an engine
        that has just been told to start it does not show it yet."""
        if any(each.active for each in parts):
            self._since = None
            return False
        self._since = self._since if self._since is not None else anyio.current_time()
        return self._exact or asked - self._since >= _STARTING_S


def _long_enough(shown: Sequence[Snapshot]) -> float:
    """Return for how long a graph like this must be seen at rest, in seconds."""
    return _AGAIN_S if any(each.spontaneous for each in shown) else _STARTING_S
