"""The pen of a run: in order, once, and in nobody's way."""

import anyio

from action_assistant.runner.runs.events import AlarmRaised
from action_assistant.runner.runs.recorder import RunRecorder, stream_of
from runner.harness import MemoryLedger, until, virtual


def alarm(number: int) -> AlarmRaised:
    return AlarmRaised(number, "n", str(number))


def written(ledger: MemoryLedger) -> list[str]:
    return [each.text for each in ledger.told("r") if isinstance(each, AlarmRaised)]


@virtual
async def test_events_are_stored_in_the_order_in_which_they_were_told() -> None:
    ledger = MemoryLedger()
    pen = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(pen.run)
        for number in range(1_200):
            pen.put(alarm(number), "")
            if number % 100 == 0:
                await anyio.sleep(0.01)
        await pen.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == [str(number) for number in range(1_200)]
    assert pen.seq == 1_200


@virtual
async def test_a_journal_that_fails_loses_nothing_and_is_told() -> None:
    ledger = MemoryLedger()
    states: list[bool] = []
    pen = RunRecorder(ledger, "r", 0, lambda: states.append(pen.recorded))
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(pen.run)
        ledger.down = True
        pen.put(alarm(1), "")
        await anyio.sleep(10)
        pen.put(alarm(2), "")
        assert (pen.recorded, pen.idle) == (False, False)
        ledger.down = False
        await pen.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == ["1", "2"]
    assert states[0] is False
    assert states[-1] is True


@virtual
async def test_a_commit_whose_answer_got_lost_is_not_repeated() -> None:
    ledger = MemoryLedger()
    pen = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(pen.run)
        ledger.forgetful = True
        pen.put(alarm(1), "")
        await anyio.sleep(0.01)
        pen.put(alarm(2), "")
        await anyio.sleep(5)
        ledger.forgetful = False
        pen.put(alarm(3), "")
        await pen.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == ["1", "2", "3"]


@virtual
async def test_telling_never_waits_for_a_slow_journal() -> None:
    ledger = MemoryLedger()
    ledger.slow = 5.0
    pen = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(pen.run)
        began = anyio.current_time()
        for number in range(100):
            pen.put(alarm(number), "")
        assert anyio.current_time() == began
        await until(lambda: pen.idle)
        tasks.cancel_scope.cancel()
    assert len(ledger.streams[stream_of("r")]) == 100
