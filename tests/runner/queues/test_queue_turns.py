"""A turn in the queue: what a look is good for, and what its refusals say."""

import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.queues.entry import OpenQueueRequest, TurnRequest, request_of
from action_assistant.runner.runs.doubts import Doubt
from runner.harness import virtual
from runner.queues.test_queues import Lab, on, put, queue_of, reopened, started
from runner.start.test_rights_registry import ANN, BEN, author


@virtual
async def test_a_look_from_before_a_stop_starts_nothing_when_the_queue_is_open_again() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry = await put(queues, on("David"))
        look = await queues.look(entry.id, {}, ANN)
        control.stop_robot("David", author(BEN))
        await reopened(queues, "David")
        with pytest.raises(Conflict, match="Look again"):
            await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
        assert lab.david.starts == []
        await started(queues, entry)
        assert len(lab.david.starts) == 1


@virtual
async def test_a_start_of_an_entry_is_under_way_while_the_runner_looks() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        entry = await put(queues, on("David"))
        assert not queues.is_under_way(request_of(entry.id))
        async with entry.turn:
            assert queues.is_under_way(request_of(entry.id))


@virtual
async def test_a_refusal_of_a_closed_queue_quotes_no_run_and_no_refused_start() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        entry = await put(queues, on("David"))
        for doubt in (Doubt("refused", "Pick secret."), Doubt("lost", "Pick secret.", run="r")):
            queues._doubts.meet(queue_of(queues, "David"), doubt)
            asked = OpenQueueRequest("another")
            for press in (queues.open("David", asked, author(BEN), BEN), started(queues, entry)):
                with pytest.raises(Conflict) as refused:
                    await press
                assert "secret" not in refused.value.detail
            await reopened(queues, "David")
