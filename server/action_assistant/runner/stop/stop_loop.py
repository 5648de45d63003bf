"""Decide when the stop messages of one run leave: from the first press on, again and again.

Nothing here waits for anything but its own turn: a message leaves while a get hangs and while the journal
is down. Whoever sends them ends this when rest is proven (`OpenRun`).
"""

import asyncio
import itertools
from collections.abc import AsyncIterator
from typing import Final, NamedTuple

import anyio

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.runs.events import Author, StopRequested
from action_assistant.runner.runs.run import Run

_FIRST_GAP_S: Final = 0.1
_GAP_S: Final = 1.0
_VAIN_GAP_S: Final = 30.0  # between stops that the engine has obeyed as far as it will
_ONE_PRESS_S: Final = 1.0


class StopAttempt(NamedTuple):
    """One stop message that is due: its number, and since when stops are sent, in seconds of the event
    loop's clock."""

    number: int
    since: float


class StopLoop:
    """Takes presses of Stop for one run, and yields the times at which stop messages are due.
    `hung`: why the engine will never answer again; `is_held_elsewhere`: the run is lost, but the
    process of the engine that answers now has it."""

    def __init__(self, run: Run, clock_us: ClockUs) -> None:
        self.hung = ""
        self.is_held_elsewhere = False
        self._run = run
        self._clock_us = clock_us
        self._wanted = anyio.Event()
        self._pressed = anyio.Event()
        self._news = anyio.Event()
        self._vain = False  # the engine had obeyed the last message as far as it will
        self._ids: set[str] = {""}
        self._asked: tuple[str, float] = ("", 0.0)
        if run.desired == "stopped":
            self._wanted.set()

    def press(self, author: Author, stop_id: str) -> StopRequested | None:
        """Request the Stop in the name of `author`, and return the event to record; None if this is
        the same press again, which may arrive several times on several ways. `stop_id`: the id of
        the press."""
        # Unlike `anyio.current_time` this needs no task: Stop works from any caller.
        now, (who, when) = asyncio.get_running_loop().time(), self._asked
        is_new = who != author.id or (stop_id not in self._ids and now - when > _ONE_PRESS_S)
        if is_new:
            self._asked = (author.id, now)
        self._ids.add(stop_id)
        self._wanted.set()
        self._pressed.set()
        self._news.set()
        return StopRequested(self._clock_us(), author, stop_id) if is_new else None

    def notice(self, run: Run) -> None:
        """Process the present state of the run: if the last stop message was useless and the next
        one may not be, that is sent soon."""
        self._run = run
        if self._vain and not _are_stops_useless(run):
            self._news.set()

    async def attempts(self) -> AsyncIterator[StopAttempt]:
        """Yield each stop message when it is due, without end."""
        await self._wanted.wait()
        since, gap = anyio.current_time(), _FIRST_GAP_S
        for number in itertools.count(self._run.stops_sent + 1):
            await self._until_due()
            yield StopAttempt(number, since)
            self._vain = _are_stops_useless(self._run)
            self._news = anyio.Event()
            with anyio.move_on_after(gap) as quiet:
                await self._news.wait()
            gap = min(gap * 1.5, _VAIN_GAP_S if self._vain else _GAP_S)
            if not quiet.cancelled_caught:
                gap = _FIRST_GAP_S

    async def _until_due(self) -> None:
        """Wait until the next stop message may be sent. That is at once while an engine holds the
        run; later a person has to press Stop for each message, since a graph of that name would be
        another one."""
        while self._run.lost and not (self._pressed.is_set() or self.is_held_elsewhere):
            with anyio.move_on_after(_GAP_S):
                await self._pressed.wait()
        self._pressed = anyio.Event()


def _are_stops_useless(run: Run) -> bool:
    """Return whether further stop messages are useless: nothing of the run moves any more, and the
    engine can never prove it."""
    return bool(run.unconfirmed) and not run.active and run.unknown_since is None
