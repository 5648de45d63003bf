"""Entries that an earlier process has stored: those that cannot be started say why, and block nobody."""

from typing import Any

import msgspec
import pytest

from action_assistant.errors import Conflict, Forbidden
from action_assistant.journal.events import Draft
from action_assistant.runner.queues.entry import (
    Looked,
    QueueRequest,
    QueueStartKept,
    TurnRequest,
    entered_of,
    entry_id,
    stream_of,
)
from action_assistant.runner.queues.views import queue_view
from action_assistant.runner.runs.events import draft_of
from action_assistant.runner.start.kept_starts import text_of
from runner.harness import clock_us, order, sequence, virtual
from runner.queues.test_queues import Lab, on, put, reopened, started
from runner.start.test_rights_registry import ANN, BEN, author


def stored(request: QueueRequest) -> list[Draft]:
    """Return the events of an entry of Ann's, as they are stored when she puts it into the queue."""
    entered = entered_of(request, author(ANN), clock_us(), "task", Looked({}), unsighted=False)
    kept = QueueStartKept(text_of(request.start))
    return [draft_of(entered, ANN.person.id), draft_of(kept, ANN.person.id)]


def without(draft: Draft, *fields: str, **more: Any) -> Draft:
    """Return an event whose body lacks these fields, or has others, as of another version."""
    body = {**msgspec.json.decode(draft.body), **more}
    for each in fields:
        del body[each]
    return msgspec.structs.replace(draft, body=msgspec.json.encode(body))


@virtual
async def test_what_cannot_be_started_any_more_says_why_blocks_nobody_and_can_be_removed() -> None:
    lab = Lab()
    cast = QueueRequest(
        start=order(sequence(), engine="simulator", robots={"a": "David", "b": "Carol"})
    )
    no_robots, no_start, other_start = (on("David", request_id=each) for each in "xyz")
    bodies = {
        entry_id(cast.start.request_id): stored(cast),
        entry_id("x"): [without(stored(no_robots)[0], "robots"), stored(no_robots)[1]],
        entry_id("y"): [stored(no_start)[0], without(stored(no_start)[1], "start")],
        entry_id("z"): [stored(other_start)[0], without(stored(other_start)[1], start={"of": 1})],
    }
    for id_, drafts in bodies.items():
        await lab.harness.journal.append(stream_of(id_), drafts)
    async with lab.runner() as (_, queues):
        whole = await put(queues, on("David"), BEN)
        assert whole.waits == ()  # none of the older ones is before it
    async with lab.runner() as (control, queues):
        shown = {each.id: each for each in queue_view(queues, lambda _: None, None).entries}
        assert {id_: each.obstacle for id_, each in shown.items()} == {
            entry_id(cast.start.request_id): (
                "This cannot be started, remove it: Only a led run has several robots."
            ),
            entry_id("x"): "It cannot be read: another version of this program has stored it.",
            entry_id("y"): "This cannot be started, remove it: its start cannot be read.",
            entry_id("z"): "This cannot be started, remove it: its start cannot be read.",
            whole.id: "",
        }
        assert {each.name for each in queues.robot_queues} == {"David"}
        await reopened(queues, "David")
        await started(queues, queues.find(whole.id), BEN)
        for id_ in bodies:
            why = shown[id_].obstacle
            with pytest.raises(Conflict) as refused:
                await queues.look(id_, {}, ANN)
            assert refused.value.detail == why
            with pytest.raises(Conflict) as refused:
                await queues.start(id_, TurnRequest("any"), author(ANN), ANN)
            assert refused.value.detail == why
            with pytest.raises(Forbidden):
                await queues.remove(id_, author(BEN), BEN)
        owner = msgspec.structs.replace(
            BEN, person=msgspec.structs.replace(BEN.person, id="olga", role="owner")
        )
        by = dict(zip(bodies, (ANN, owner, ANN, owner), strict=True))
        for id_, who in by.items():
            await queues.remove(id_, author(who), who)
        assert (queues.entries, len(lab.david.starts), lab.carol.starts) == ((), 1, [])
        control.stop_all(author(ANN))
    async with lab.runner() as (_, queues):
        assert queues.entries == ()
