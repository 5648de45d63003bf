"""A start that its checks have accepted, and what has to hold still when its message leaves."""

import msgspec

from action_assistant.runner.links.port import Link, NotSent
from action_assistant.runner.links.simulator import LeadableLink
from action_assistant.runner.runs.events import Overridden
from action_assistant.runner.start.admission import Prepared, PreparedPieces, StartRequest
from action_assistant.runner.start.approvals import Approved
from action_assistant.runner.start.orders import overridden_in
from action_assistant.umrf.breakpoints import Breakpoint


class LedStart(msgspec.Struct, frozen=True, kw_only=True):
    """The part of an accepted start that only a led run has. `lives`: the id of each robot's
    engine process when it was checked; `by_word`: those of them of which only the starter vouches
    that they index their files once; `keeping`: the robots that have the helper package; `engine`:
    plays the whole graph."""

    pieces: PreparedPieces
    lives: dict[str, str]
    by_word: dict[str, str]
    keeping: tuple[str, ...]
    engine: LeadableLink


class AcceptedStart(msgspec.Struct, frozen=True, kw_only=True):
    """A start that nothing prevents. It is sent over `link`, which the run owns if simulated, to
    the engine process with the id `incarnation`. `doubt`: why its answers prove nothing, as the
    starter has seen it; `despite`: problems that a person overrides; `led`: the further part of a
    led run, else None; `keeps`: the engine has the helper package, so that values can be read
    from it; `approved`: the yes by which robots take it."""

    request: StartRequest
    prepared: Prepared
    link: Link
    is_simulated: bool
    incarnation: str
    doubt: str = ""
    despite: tuple[Overridden, ...] = ()
    led: LedStart | None = None
    keeps: bool = False
    approved: tuple[Approved, ...] = ()

    @property
    def overridden(self) -> tuple[str, ...]:
        """The codes of the problems that the starter has chosen to override."""
        return overridden_in(self.request)

    @property
    def breakpoints(self) -> tuple[Breakpoint, ...]:
        """The breakpoints at which the run will wait: none if its engine gets the whole graph."""
        return self.led.pieces.breakpoints if self.led else ()

    def require_still(self) -> None:
        """Check, right before the start message leaves, that it goes to the engine that was asked; do
        not wait. Raise NotSent if the engine was restarted since, or if its answers prove nothing for
        a reason that the starter has not seen. Pieces of a led run are checked by their conductor."""
        standing = self.link.standing
        if self.is_simulated or self.led is not None:
            return
        name = self.request.engine
        if standing.incarnation not in {"", self.incarnation}:
            raise NotSent(f"The engine of {name} was restarted since it was looked at.")
        if standing.doubt not in {"", self.doubt}:
            raise NotSent(f"{name} has changed since it was looked at: {standing.doubt}.")
