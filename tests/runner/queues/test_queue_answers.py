"""An entry of the queue asks people for what its start lacks, and one whose answer was lost can be found."""

import anyio
import anyio.lowlevel
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.links.port import Registration
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.views import QueuedStart
from action_assistant.runner.start.approvals import ApprovalRequest
from runner.harness import until, virtual
from runner.queues.test_queues import Lab, on, put, started
from runner.start.test_rights_registry import ANN, BEN, author


@virtual
async def test_at_its_turn_a_second_person_says_yes_to_exactly_what_is_started() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        demanding = Registration(name="David", profile={"second_person": True})
        await control.register(demanding, author(ANN))
        await until(lambda: control.robots.robot("David").heard_at is not None)
        override = Override(("others",), "It only listens.")  # nobody else is there any more
        entry = await put(queues, on("David", override=override))
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await started(queues, entry)
        look = await queues.look(entry.id, {}, BEN)
        assert look.overridden == ("others",)
        wanted = next(each.order_digest for each in look.looks if each.order_digest)
        await control.approvals.give(ApprovalRequest(digest=wanted), author(BEN))
        await started(queues, entry)
        assert len(lab.david.starts) == 1


@virtual
async def test_what_a_start_for_the_queue_has_become_is_known_by_its_request_id() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        request = on("David")
        id_ = request.start.request_id
        assert (queues.is_under_way(id_), await queues.queued(id_)) == (False, None)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(put, queues, request)
            await anyio.lowlevel.checkpoint()
            assert queues.is_under_way(id_)
        entry = queues.entries[0]
        assert (queues.is_under_way(id_), await queues.queued(id_)) == (
            False,
            QueuedStart(entry.id, True),
        )
        assert await queues.queued(f"{id_} not") is None
        await started(queues, entry)
        assert await queues.queued(id_) == QueuedStart(entry.id, False)
