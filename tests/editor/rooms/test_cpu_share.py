"""A socket is slowed down for the processor time that its edits take from the loop, and for nothing else."""

import time
from collections.abc import Callable
from typing import Any

import pytest

from action_assistant.editor.crdt.replica import Replica, UpdateEffect
from action_assistant.editor.rooms import member as member_module
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.kit.token_bucket import TokenBucket
from action_assistant.web.auth.keys import Person
from editor.client import STREAM, Client, settle


def delayed_by(monkeypatch: pytest.MonkeyPatch, wait: Callable[[], None]) -> None:
    """Do something while each update is applied."""
    take = Replica.take

    def slower(self: Replica, *values: Any, **named: Any) -> UpdateEffect:
        wait()
        return take(self, *values, **named)

    monkeypatch.setattr(Replica, "take", slower)


def busy_for(seconds: float) -> None:
    """Use so much of a processor."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


async def edited(rooms: Rooms, edits: int) -> Member:
    """The member of somebody who has made some edits."""
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        for n in range(edits):
            ada.map[f"a{n}"] = "1"
            await settle(ada)
        assert ada.member is not None
        return ada.member


async def test_time_in_which_the_machine_did_something_else_costs_nothing(
    rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    delayed_by(monkeypatch, lambda: time.sleep(0.08))
    member = await edited(rooms, 4)
    assert not member.is_over_cpu_budget
    assert member.cpu_debt() == 0


async def test_edits_that_keep_the_loop_busy_are_read_later(
    rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    delayed_by(monkeypatch, lambda: busy_for(0.3))
    member = await edited(rooms, 2)
    assert member.is_over_cpu_budget
    assert member.cpu_debt() > 0


async def test_a_person_who_edits_a_hundred_times_a_second_for_an_hour_never_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 0.0

    def bucket(capacity: float, rate: float) -> TokenBucket:
        return TokenBucket(capacity, rate, lambda: now)

    monkeypatch.setattr(member_module, "TokenBucket", bucket)
    member = Member(Person("ada", "Ada"))
    for n in range(100 * 3600):
        now = n / 100
        member.used_cpu(0.001)  # ten times what an edit takes
        assert not member.is_over_cpu_budget
