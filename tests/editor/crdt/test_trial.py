"""Large edits are tried in another process first: what becomes of them when that has its own troubles."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import pytest
from anyio import CapacityLimiter

from action_assistant.editor.crdt import messages, trial
from action_assistant.editor.crdt.trial import tried
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import TooMany
from action_assistant.journal.journal import Journal
from action_assistant.web.workers.lanes import Crashed, GaveUp, Lane
from editor.client import Client, settle
from editor.test_nobody_waits import at_once

T = TypeVar("T")


class Troubled:
    """A way aside that fails with these first."""

    def __init__(self, *errors: Exception) -> None:
        self.errors = list(errors)
        self.asked = 0

    async def __call__(self, work: Callable[..., T], /, *args: Any) -> T:
        if args[1] == messages.NOTHING_NEW:  # only measures
            return work(*args)
        self.asked += 1
        if self.errors:
            raise self.errors.pop(0)
        return work(*args)


@asynccontextmanager
async def edited(
    journal: Journal, run_in_worker: Troubled | Lane, update: bytes
) -> AsyncIterator[Member]:
    """Let one person send the update and another one go on, and return the sender's member."""
    rooms = Rooms(journal, linger=60, window=0, tried=run_in_worker)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        eve.join(room)
        await settle(ada, eve)
        eve.deliver(messages.change(update))
        await room.quiet()
        assert eve.member is not None
        yield eve.member
        ada.map["k"] = "v"
        await settle(ada)
        assert ada.durable == ada.sent
    await rooms.close()


@pytest.fixture
def large() -> bytes:
    return at_once(2_000)


@pytest.mark.parametrize("trouble", [TooMany("enough"), GaveUp("took too long")])
async def test_whose_edit_finds_the_machine_busy_may_send_it_again(
    journal: Journal, large: bytes, trouble: Exception
) -> None:
    run_in_worker = Troubled(trouble)
    async with edited(journal, run_in_worker, large) as member:
        assert await member.ended() == messages.TOO_SLOW
        assert "busy" in (member.close_text or "")
    assert run_in_worker.asked == 1


async def test_one_process_that_dies_is_not_taken_for_the_edits_fault(
    journal: Journal, large: bytes
) -> None:
    run_in_worker = Troubled(Crashed("killed"))
    async with edited(journal, run_in_worker, large) as member:
        assert not member.refused
    assert run_in_worker.asked == 2


async def test_an_edit_that_ends_two_processes_is_refused(journal: Journal, large: bytes) -> None:
    run_in_worker = Troubled(Crashed("killed"), Crashed("killed"))
    async with edited(journal, run_in_worker, large) as member:
        assert await member.ended() == messages.MALFORMED
    assert run_in_worker.asked == 2


async def test_an_edit_that_would_take_minutes_costs_seconds(journal: Journal) -> None:
    lane = Lane("edits", 1, 120.0, 0, CapacityLimiter(2), [trial.__name__])
    async with edited(journal, lane, at_once(120_000)) as member:
        assert await member.ended() == messages.TOO_BIG
        assert "so long" in (member.close_text or "")
    lane.close()


def test_the_process_that_serves_is_not_ended_by_what_it_tries(large: bytes) -> None:
    assert tried(b"\x00\x00", large, []).brings
