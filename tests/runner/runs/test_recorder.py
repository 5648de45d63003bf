"""The recorder of a run: in order, once, and in nobody's way."""

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
    recorder = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        for number in range(1_200):
            recorder.put(alarm(number), "")
            if number % 100 == 0:
                await anyio.sleep(0.01)
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == [str(number) for number in range(1_200)]
    assert recorder.seq == 1_200


@virtual
async def test_a_journal_that_fails_loses_nothing_and_is_told() -> None:
    ledger = MemoryLedger()
    states: list[bool] = []
    recorder = RunRecorder(ledger, "r", 0, lambda: states.append(recorder.recorded))
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        ledger.down = True
        recorder.put(alarm(1), "")
        await anyio.sleep(10)
        recorder.put(alarm(2), "")
        assert (recorder.recorded, recorder.idle) == (False, False)
        ledger.down = False
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == ["1", "2"]
    assert states[0] is False
    assert states[-1] is True


@virtual
async def test_a_commit_whose_answer_got_lost_is_not_repeated() -> None:
    ledger = MemoryLedger()
    recorder = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        ledger.forgetful = True
        recorder.put(alarm(1), "")
        await anyio.sleep(0.01)
        recorder.put(alarm(2), "")
        await anyio.sleep(5)
        ledger.forgetful = False
        recorder.put(alarm(3), "")
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(ledger) == ["1", "2", "3"]


@virtual
async def test_telling_never_waits_for_a_slow_journal() -> None:
    ledger = MemoryLedger()
    ledger.slow = 5.0
    recorder = RunRecorder(ledger, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        began = anyio.current_time()
        for number in range(100):
            recorder.put(alarm(number), "")
        assert anyio.current_time() == began
        await until(lambda: recorder.idle)
        tasks.cancel_scope.cancel()
    assert len(ledger.streams[stream_of("r")]) == 100
