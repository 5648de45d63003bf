"""The recorder of a run: in order, once, and in nobody's way."""

import anyio
import pytest

from action_assistant.runner.runs.events import AlarmRaised
from action_assistant.runner.runs.recorder import RunRecorder, stream_of
from runner.harness import MemoryJournal, until, virtual


def alarm(number: int) -> AlarmRaised:
    return AlarmRaised(number, "n", str(number))


def written(journal: MemoryJournal) -> list[str]:
    return [each.text for each in journal.told("r") if isinstance(each, AlarmRaised)]


@virtual
async def test_events_are_stored_in_the_order_in_which_they_were_told() -> None:
    journal = MemoryJournal()
    recorder = RunRecorder(journal, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        for number in range(1_200):
            recorder.put(alarm(number), "")
            if number % 100 == 0:
                await anyio.sleep(0.01)
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(journal) == [str(number) for number in range(1_200)]
    assert recorder.seq == 1_200


@virtual
async def test_a_journal_that_fails_loses_nothing_and_is_told() -> None:
    journal = MemoryJournal()
    states: list[bool] = []
    recorder = RunRecorder(journal, "r", 0, lambda: states.append(recorder.recorded))
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        journal.down = True
        recorder.put(alarm(1), "")
        await anyio.sleep(10)
        recorder.put(alarm(2), "")
        assert (recorder.recorded, recorder.idle) == (False, False)
        journal.down = False
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(journal) == ["1", "2"]
    assert states[0] is False
    assert states[-1] is True


@virtual
async def test_a_commit_whose_answer_got_lost_is_not_repeated() -> None:
    journal = MemoryJournal()
    recorder = RunRecorder(journal, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        journal.forgetful = True
        recorder.put(alarm(1), "")
        await anyio.sleep(0.01)
        recorder.put(alarm(2), "")
        await anyio.sleep(5)
        journal.forgetful = False
        recorder.put(alarm(3), "")
        await recorder.flushed()
        tasks.cancel_scope.cancel()
    assert written(journal) == ["1", "2", "3"]


@virtual
async def test_telling_never_waits_for_a_slow_journal() -> None:
    journal = MemoryJournal()
    journal.slow = 5.0
    recorder = RunRecorder(journal, "r", 0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(recorder.run)
        began = anyio.current_time()
        for number in range(100):
            recorder.put(alarm(number), "")
        assert anyio.current_time() == began
        await until(lambda: recorder.idle)
        tasks.cancel_scope.cancel()
    assert len(journal.streams[stream_of("r")]) == 100


@virtual
async def test_events_that_wait_at_cancellation_are_still_stored() -> None:
    journal = MemoryJournal()
    journal.streams[stream_of("r")] = []
    recorder = RunRecorder(journal, "r", -1)
    async with anyio.create_task_group() as tasks:
        journal.slow = 0.3
        tasks.start_soon(recorder.run)
        recorder.put(alarm(1), "")
        await anyio.sleep(0.2)
        recorder.put(alarm(2), "")
        tasks.cancel_scope.cancel()
    assert written(journal) == ["1", "2"]


@virtual
async def test_a_commit_that_is_ended_after_it_was_made_is_not_repeated() -> None:
    journal = MemoryJournal()
    recorder = RunRecorder(journal, "r", 0)
    async with anyio.create_task_group() as tasks:
        journal.forgetful = True
        tasks.start_soon(recorder.run)
        recorder.put(alarm(1), "")
        await anyio.sleep(0.01)
        recorder.put(alarm(2), "")
        journal.forgetful = False
        tasks.cancel_scope.cancel()
    assert written(journal) == ["1", "2"]


@virtual
async def test_a_journal_that_never_answers_holds_up_the_end_for_a_second(
    caplog: pytest.LogCaptureFixture,
) -> None:
    journal = MemoryJournal()
    recorder = RunRecorder(journal, "r", 0)
    async with anyio.create_task_group() as tasks:
        journal.slow = 100.0
        tasks.start_soon(recorder.run)
        recorder.put(alarm(1), "")
        await anyio.sleep(0.1)
        began = anyio.current_time()
        tasks.cancel_scope.cancel()
    assert anyio.current_time() - began == pytest.approx(1.0)
    assert "run/r lacks its last 1 events" in caplog.text
