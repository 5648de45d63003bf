"""The last answer is known at once, with its age; a check that is running is not started twice."""

import asyncio

import pytest

from action_assistant.kit.shared_check import SharedCheck


async def test_the_last_answer_is_there_at_once_while_it_is_asked_again() -> None:
    asked, may_answer = 0, asyncio.Event()

    async def ask() -> int:
        nonlocal asked
        asked += 1
        await may_answer.wait()
        return asked

    check = SharedCheck(ask, patience=20.0, fresh=0.0)
    assert (check.last, check.under_way, check.failure) == (None, None, None)
    first = check.begin()
    assert check.begin() is first
    await asyncio.sleep(0)
    assert check.last is None
    assert check.under_way is not None
    may_answer.set()
    assert await check.answer() == 1
    may_answer.clear()
    check.begin()
    await asyncio.sleep(0)
    assert asked == 2
    assert check.last is not None
    answer, age, took = check.last
    assert answer == 1
    assert age >= 0
    assert took >= 0
    may_answer.set()
    assert await check.answer() == 2


async def test_a_failure_is_told_beside_what_was_answered_before() -> None:
    answers = iter([1])

    async def ask() -> int:
        found = next(answers, None)
        if found is None:
            raise OSError("no process")
        return found

    check = SharedCheck(ask, patience=20.0, fresh=0.0)
    assert await check.answer() == 1
    with pytest.raises(OSError, match="no process"):
        await check.begin()
    assert check.last is not None
    assert check.last[0] == 1
    assert isinstance(check.failure, OSError)
    assert check.under_way is None
