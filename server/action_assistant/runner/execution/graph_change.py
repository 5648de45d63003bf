"""A change of a running graph: told before it is sent, and what became of it.

An engine acknowledges no change, so what counts is whether the message has left.
"""

import logging
from typing import Final, Protocol

from action_assistant.errors import OutcomeUnknown
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.links.port import EngineRefused, Link, NotSent, Order
from action_assistant.runner.runs.events import ModifyRefused, ModifyRequested, RunEvent
from action_assistant.runner.runs.run import Run

log: Final = logging.getLogger(__name__)


class ChangeMonitor(Protocol):
    """What watches the run."""

    def sends(self, umrf: str, *, beside: bool = False) -> None:
        """This graph is handed over: what the engine shows is compared with it."""
        ...

    def look(self) -> None:
        """Ask the engine now."""
        ...


class ChangedRun(Protocol):
    """The run that is changed."""

    run: Run

    @property
    def watch(self) -> ChangeMonitor:
        """What watches it."""
        ...

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show and store an event."""
        ...

    def alarm(self, code: str, text: str) -> None:
        """Tell people something now."""
        ...


async def send_change(
    it: ChangedRun, link: Link, order: Order, asked: ModifyRequested, clock_us: ClockUs
) -> None:
    """Send one change. Raises NotSent and EngineRefused, then the graph is as it was; OutcomeUnknown
    when nobody knows whether it is."""
    before = it.run
    it.tell(asked, asked.author.id)
    try:
        await link.modify(order, asked.continue_from)
    except (NotSent, EngineRefused) as why:
        it.tell(
            ModifyRefused(
                at=clock_us(),
                version=before.version,
                digest=before.digest,
                actions={name: action.aid for name, action in before.actions.items()},
                why=str(why),
            )
        )
        raise
    except Exception as error:  # also a deadline: the message may have left
        log.exception("run %s: the change may or may not have left", before.id)
        text = f"Nobody knows whether the graph was changed on {before.engine}: {error!r}"
        it.alarm("modify_unknown", text)
        _compare(it, order, asked)
        raise OutcomeUnknown(text) from error
    _compare(it, order, asked)


def _compare(it: ChangedRun, order: Order, asked: ModifyRequested) -> None:
    it.watch.sends(order.umrf, beside=bool(asked.continue_from))
    it.watch.look()
