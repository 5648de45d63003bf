"""Sends stop messages, and decides whether answers show a graph at rest for long enough to prove it."""

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
_AGAIN_S: Final = 2.0  # a spontaneous action is FINISHED for a moment between two visits
_SEND_S: Final = 1.0
#: Commands after which a graph that was at rest may move.
SET_GOING: Final = frozenset({"start", "resume", "modify"})


async def send_stop(link: Link, graph: str) -> str:
    """Send one stop message for a graph, waiting a second at most; return why that failed, "" if it
    was sent. No error is raised."""
    try:
        with anyio.fail_after(_SEND_S):
            await link.stop(graph)
    except NotSent as why:
        return str(why) or "not sent"
    except TimeoutError:
        return "the message could not be handed over within a second"
    except Exception as error:  # the next stop has to be sent although the link failed
        log.exception("a stop of %s may or may not have left", graph)
        return f"the link failed: {error!r}"
    return ""


def hash_of(shown: Sequence[Snapshot]) -> str:
    """Return the SHA-256 of the snapshots in an answer, for the record of a proof."""
    return hashlib.sha256(msgspec.json.encode(list(shown))).hexdigest()


class RestProof:
    """Decides from several answers whether a graph is at rest (nothing of it moves); actions that
    are loading are judged elsewhere, by `LoadingWatch`. An action that was loaded before and is
    triggered again is RUNNING only after its thread starts, so one answer is not enough: the graph
    must be seen at rest for a while. A graph in RUNNING without a running action may be about to
    start one. `exact`: an engine that hides nothing, as the simulator."""

    def __init__(self, *, exact: bool) -> None:
        self._exact = exact
        self._since: float | None = None

    def forget(self) -> None:
        """Start over: the graph was not seen, or another program may have started it."""
        self._since = None

    @property
    def pending(self) -> bool:
        """True if nothing moved in the last answer."""
        return self._since is not None

    def seen(self, shown: Sequence[Snapshot], asked: float) -> bool:
        """Process one more answer of the engine, requested at `asked` (seconds of the event loop).
        `shown`: the snapshot of the graph, then the snapshots of its sub-graphs. Return whether the
        answers so far prove that the graph is at rest, that is, for long enough without an active
        action."""
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
        """Process one more answer that lacks a graph but shows its sub-graphs (`parts`). `asked`:
        the time of the request, in seconds of the event loop. Return whether the graph has been
        missing, without an active action in `parts`, for long enough to be proven at rest: an
        engine does not show a graph at once after its start."""
        if any(each.active for each in parts):
            self._since = None
            return False
        self._since = self._since if self._since is not None else anyio.current_time()
        return self._exact or asked - self._since >= _STARTING_S


def _long_enough(shown: Sequence[Snapshot]) -> float:
    """Return for how many seconds a graph (`shown`: with its sub-graphs) must be seen without
    motion to count as at rest: longer with spontaneous actions, which begin again."""
    return _AGAIN_S if any(each.spontaneous for each in shown) else _STARTING_S
