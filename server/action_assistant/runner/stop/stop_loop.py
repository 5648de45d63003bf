"""The loop of Stop of one run: from the first press on, a message again and again until rest is
proven.

Never waits for anything but its own turn: it is sent while a get hangs and while the journal is down.
"""

import itertools
from collections.abc import Callable
from typing import Final, Protocol

import anyio

from action_assistant.runner.links.port import Link
from action_assistant.runner.runs.events import Author, End, RunEvent, StopRequested, StopSent
from action_assistant.runner.runs.run import Run
from action_assistant.runner.stop.proof import send_stop

_FIRST_GAP_S: Final = 0.1
_GAP_S: Final = 1.0
_VAIN_GAP_S: Final = 30.0  # between two stops that can bring nothing more
_UNCONFIRMED_S: Final = 2.0
_SWITCH_OFF_S: Final = 10.0  # a simulated engine that does not obey harms nobody
_ONE_PRESS_S: Final = 1.0


class StopMonitor(Protocol):
    """What watches the run. `trouble`: why there is no proof of rest yet."""

    trouble: str

    def look(self) -> None:
        """Ask the engine now."""
        ...

    def stop_left(self) -> None:
        """A message to stop has left: what was asked before proves nothing."""
        ...


class StoppableRun(Protocol):
    """The run that is stopped."""

    run: Run

    @property
    def watch(self) -> StopMonitor:
        """What watches it."""
        ...

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show and store an event."""
        ...

    def end(self, state: End, detail: str) -> None:
        """The run is over."""
        ...

    def alarm(self, code: str, text: str) -> None:
        """Tell people something now."""
        ...


class StopLoop:
    """Presses, and the messages that follow. `hung`: why its engine will not answer any more."""

    def __init__(
        self, it: StoppableRun, link: Link, *, simulated: bool, clock_us: Callable[[], int]
    ) -> None:
        self.hung = ""
        self._it = it
        self._link = link
        self._simulated = simulated
        self._clock_us = clock_us
        self._wanted = anyio.Event()
        self._pressed = anyio.Event()
        self._news = anyio.Event()
        self._vain = False  # the last message could bring nothing more
        self._ids: set[str] = {""}
        self._asked: tuple[str, float] = ("", 0.0)
        if it.run.desired == "stopped":
            self._wanted.set()

    def press(self, author: Author, stop_id: str) -> None:
        """Want the run stopped. One press may come several times and by several ways; it is recorded
        once."""
        now, (who, when) = anyio.current_time(), self._asked
        if who != author.id or (stop_id not in self._ids and now - when > _ONE_PRESS_S):
            self._asked = (author.id, now)
            self._it.tell(StopRequested(self._clock_us(), author, stop_id), author.id)
        self._ids.add(stop_id)
        self._wanted.set()
        self._pressed.set()
        self._news.set()

    def notice(self) -> None:
        """Something is known that was not: where a Stop was in vain it may not be any more."""
        if self._vain and not _is_vain(self._it.run):
            self._news.set()

    async def run(self) -> None:
        """Send until cancelled; a simulated engine that does not obey is given up."""
        await self._wanted.wait()
        began, gap = anyio.current_time(), _FIRST_GAP_S
        for attempt in itertools.count(self._it.run.stops_sent + 1):
            await self._turn()
            failed = await send_stop(self._link, self._it.run.graph_name)
            if not failed:
                self._it.watch.stop_left()
            self._it.tell(StopSent(self._clock_us(), attempt, failed))
            self._it.watch.look()
            waited = anyio.current_time() - began
            if waited >= _UNCONFIRMED_S:
                why = failed or self._it.watch.trouble or "no proof has come"
                self._it.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}.")
            if self._simulated and waited >= _SWITCH_OFF_S:
                why = self.hung or f"It does not obey: {self._it.watch.trouble}."
                self._it.end("lost", f"{why} The simulated engine was switched off.")
                return
            self._vain = _is_vain(self._it.run)
            self._news = anyio.Event()
            with anyio.move_on_after(gap) as quiet:
                await self._news.wait()
            gap = min(gap * 1.5, _VAIN_GAP_S if self._vain else _GAP_S)
            if not quiet.cancelled_caught:
                gap = _FIRST_GAP_S

    async def _turn(self) -> None:
        """An engine that does not hold the run any more is told once for each press, and not again: a
        graph of that name there would be another one."""
        while self._it.run.lost and not self._pressed.is_set():
            with anyio.move_on_after(_GAP_S):
                await self._pressed.wait()
        self._pressed = anyio.Event()


def _is_vain(run: Run) -> bool:
    """Whether the engine has obeyed as far as it ever will, and proves nothing by that."""
    return bool(run.unconfirmed) and not run.active and run.unknown_since is None
