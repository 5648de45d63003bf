"""A start on several robots waits in the queue of each, and its turn comes when it is the first in all."""

from collections.abc import Sequence
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.runner.execution.start_pipeline import Grouped
from action_assistant.runner.links.port import Registration
from action_assistant.runner.queues.entry import (
    Looked,
    MoveRequest,
    QueueRequest,
    QueueStartKept,
    TurnRequest,
    Waiting,
    entered_of,
    request_of,
    stream_of,
    waits_of,
)
from action_assistant.runner.queues.robot_queue import Entry
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import draft_of
from action_assistant.runner.start.approvals import ApprovalRequest
from action_assistant.runner.start.kept_starts import group_of, text_of
from action_assistant.runner.start.orders import ordered
from action_assistant.umrf.limits import Limit
from runner.harness import clock_us, order, sequence, until, virtual
from runner.queues.test_queues import (
    Lab,
    direct,
    on,
    over,
    put,
    queue_of,
    reopened,
    why_closed,
)
from runner.start.test_rights_registry import ANN, BEN, OLGA, author

LIMIT = Limit(parameter="torque", most=60.0)
ROBOTS = ("Carol", "David", "Ed", "Flo")


def both(name: str = "task", **changes: Any) -> QueueRequest:
    """A start on both robots of the lab."""
    start = order(sequence(name), engine="David", **changes)
    return QueueRequest(start=start, engines=("David", "Carol"))


async def begun(queues: Queues, entry: Entry) -> Grouped:
    """Look at an entry as people do, and start it."""
    look = await queues.look(entry.id, {}, ANN)
    started = await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
    assert isinstance(started, Grouped)
    return started


@virtual
async def test_it_waits_for_the_last_of_its_robots_and_a_person_starts_it_on_all() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "Carol")
        entry = await put(queues, both())
        behind = await put(queues, on("David"))
        assert [(each.robot, each.why) for each in entry.waits] == [("Carol", "run")]
        assert [(each.robot, each.why) for each in behind.waits] == [("David", "behind")]
        with pytest.raises(Conflict, match="Carol is not free"):
            await begun(queues, entry)
        await over(control, run)
        await anyio.sleep(60)
        assert (len(lab.david.starts), len(lab.carol.starts)) == (0, 1)  # a person's hand
        look = await queues.look(entry.id, {}, ANN)
        assert sorted(each.engine for each in look.looks) == ["Carol", "David"]
        started = await begun(queues, entry)
        assert [each.engine for each in started.runs] == ["Carol", "David"]
        assert (len(lab.david.starts), len(lab.carol.starts)) == (1, 2)
        again = await queues.start(entry.id, TurnRequest("any"), author(BEN), BEN)
        assert isinstance(again, Grouped)
        assert ([each.id for each in again.runs], again.fresh) == (
            [each.id for each in started.runs],
            False,
        )
        assert queues.entries == (behind,)
        await until(lambda: not control.open)
        assert behind.ready_at is not None
    async with lab.runner() as (_, queues):
        assert [each.id for each in queues.entries] == [behind.id]
        with pytest.raises(NotFound):
            await queues.start("other", TurnRequest("any"), author(BEN), BEN)


@virtual
async def test_any_closed_queue_of_its_robots_keeps_it_back_and_it_keeps_nobody() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry, other = await put(queues, both()), await put(queues, on("David"))
        look = await queues.look(entry.id, {}, ANN)
        queues.close("Carol", author(BEN))
        assert [each.why for each in entry.waits] == ["closed"]
        assert other.ready_at is not None  # that of David is open
        with pytest.raises(Conflict, match="The queue of Carol is closed"):
            await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
        await reopened(queues, "Carol")
        with pytest.raises(Conflict, match="Look again"):  # the old look counts no more
            await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
        control.stop_robot("David", author(BEN))
        assert (why_closed(queues, "David"), why_closed(queues, "Carol")) == ("stop", "")
        assert entry.ready_at is None
        assert lab.david.starts == lab.carol.starts == []


@virtual
async def test_a_queue_that_closes_between_its_two_messages_holds_the_second_back() -> None:
    for at_s in (0.0, 0.5, 1.0, 1.5, 2.5):
        lab = Lab()
        async with lab.runner() as (control, queues):
            entry = await put(queues, both())
            look = await queues.look(entry.id, {}, ANN)
            lab.harness.journal.slow = 1.0
            found: list[Grouped | str] = []

            async def press(
                queues: Queues = queues,
                entry: Entry = entry,
                digest: str = look.digest,
                found: list[Grouped | str] = found,
            ) -> None:
                try:
                    started = await queues.start(entry.id, TurnRequest(digest), author(ANN), ANN)
                    assert isinstance(started, Grouped)
                    found.append(started)
                except Conflict as refused:
                    found.append(refused.detail)

            async with anyio.create_task_group() as people:
                people.start_soon(press)
                await anyio.sleep(at_s)
                if "David" in {each.name for each in queues.robot_queues}:
                    left = len(lab.david.starts)
                    queues.close("David", author(BEN))  # Carol comes first by name
                else:
                    left = 1
            lab.harness.journal.slow = 0.0
            assert len(lab.david.starts) == left, (at_s, found)
            await until(lambda control=control: not control.open)  # type: ignore[misc]
            requests = [each.request_id for each in lab.starts()]
            assert len(requests) == len(set(requests))


@virtual
async def test_two_that_want_the_same_robots_in_another_order_do_not_wait_for_each_other() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        one = await put(queues, both("one"))
        other = await put(
            queues,
            QueueRequest(
                start=order(sequence("other"), engine="Carol"), engines=("Carol", "David")
            ),
        )
        assert (one.ready_at is None, other.ready_at is None) == (False, True)
        await queues.move(one.id, MoveRequest(), author(ANN), ANN)
        assert (one.ready_at is None, other.ready_at is None) == (True, False)
        await begun(queues, other)
        await until(lambda: not control.open)
        await begun(queues, one)
        assert [len(each.starts) for each in (lab.david, lab.carol)] == [2, 2]


@virtual
async def test_it_needs_the_yes_of_a_second_person_where_one_of_its_robots_asks() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        demanding = Registration(name="Carol", profile={"second_person": True})
        await control.register(demanding, author(ANN))
        await until(lambda: control.robots.robot("Carol").heard_at is not None)
        entry = await put(queues, both())
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await begun(queues, entry)
        assert lab.david.starts == lab.carol.starts == []
        looks = (await queues.look(entry.id, {}, BEN)).looks
        (digest,) = {each.order_digest for each in looks if each.order_digest}
        await control.approvals.give(ApprovalRequest(digest=digest), author(BEN))
        assert len((await begun(queues, entry)).runs) == 2


@virtual
async def test_it_names_robots_only_and_is_put_there_once() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        for engines in (("simulator", "David"), ("Carol",), ("conducted", "David")):
            wrong = msgspec.structs.replace(both(), engines=engines)
            with pytest.raises(BadInput, match="names robots only"):
                await queues.put(wrong, author(ANN), ANN)
        request = both()
        entry = await put(queues, request)
        assert await queues.put(request, author(ANN), ANN) == (entry, False)
        alone = msgspec.structs.replace(request, engines=())
        with pytest.raises(Conflict, match="another entry"):
            await queues.put(alone, author(ANN), ANN)
        assert queue_of(queues, "Carol").robots == ("Carol",)
        assert entry.entered.requests == (
            f"{request_of(entry.id)}/Carol",
            f"{request_of(entry.id)}/David",
        )
        assert entry.entered.at <= clock_us()


def told(
    entries: Sequence[tuple[str, ...]], closed: set[str], busy: set[str]
) -> list[tuple[Waiting, ...]]:
    why = {name: ([Waiting(name, "run")] if name in busy else []) for name in ROBOTS}
    return list(waits_of(entries, closed, why))


ENTRIES = st.lists(
    st.lists(st.sampled_from(ROBOTS), min_size=1, max_size=4, unique=True).map(tuple), max_size=8
)
SOME = st.sets(st.sampled_from(ROBOTS))


@given(ENTRIES, SOME, SOME, st.randoms(use_true_random=False))
def test_however_they_are_moved_somebody_has_a_turn_and_no_robot_two_at_once(
    entries: list[tuple[str, ...]], closed: set[str], busy: set[str], chance: Any
) -> None:
    chance.shuffle(entries)  # moves: any order, which is the same for all robots
    waits = told(entries, closed, busy)
    turns = [names for names, why in zip(entries, waits, strict=True) if not why]
    robots = [name for names in turns for name in names]
    assert len(robots) == len(set(robots))
    assert set(robots).isdisjoint(closed | busy)
    free = [names for names in entries if set(names).isdisjoint(closed)]
    for names in turns:
        earlier = free[: free.index(names)]
        assert all(set(names).isdisjoint(each) for each in earlier)
    if free and not busy:
        assert free[0] in turns  # no circle of those that wait for each other
    left = [names for names in free if not set(names) & busy]
    while left and not busy:  # each start is over some time: all come to their turn
        waits = told(left, closed, set())
        before = len(left)
        left = [names for names, why in zip(left, waits, strict=True) if why]
        assert len(left) < before


CAST = {"a": "David", "b": "Carol"}


@virtual
async def test_a_cast_without_a_led_run_gets_into_no_queue_and_onto_no_robot() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        for engine in ("simulator", "Ed", "David"):
            start = order(sequence(), engine=engine, robots=CAST)
            with pytest.raises(BadInput, match="Only a led run has several robots"):
                await control.start(start, author(ANN), ANN)
            for engines in {(), ("David", "Carol") if engine == "David" else ()}:
                with pytest.raises(BadInput, match="Only a led run has several robots") as refused:
                    await put(queues, QueueRequest(start=start, engines=engines))
                assert refused.value.where == {"path": "/start/robots"}
        for name, wrong in {
            "people": order(sequence(), engine="David", people={"a": ""}),
            "like": order(sequence(), engine="David", like="Carol"),
            "script": order(sequence(), engine="David", script={"*": []}),
        }.items():
            with pytest.raises(BadInput) as refused:
                await put(queues, QueueRequest(start=wrong, engines=("David", "Carol")))
            assert refused.value.where == {"path": f"/start/{name}"}
        assert (queues.entries, lab.david.starts, lab.carol.starts) == ((), [], [])


@virtual
async def test_a_stored_entry_with_a_cast_is_no_start_on_several_robots() -> None:
    lab = Lab()
    start = order(sequence(), engine="simulator", robots=CAST)
    request, seen = QueueRequest(start=start), Looked({})
    entered = entered_of(request, author(ANN), clock_us(), "task", seen, unsighted=False)
    drafts = [draft_of(entered), draft_of(QueueStartKept(text_of(start)))]
    await lab.harness.journal.append(stream_of(entered.entry), drafts)  # as the version before did
    async with lab.runner() as (_, queues):
        (kept,) = queues.entries
        assert (kept.entered.robots, kept.entered.together) == (("Carol", "David"), ())
        with pytest.raises(Conflict, match="remove it: Only a led run has several robots"):
            await queues.look(kept.id, {}, ANN)
        assert queues.robot_queues == ()
        await queues.remove(kept.id, author(ANN), ANN)
        assert (queues.entries, lab.david.starts, lab.carol.starts) == ((), [], [])


@virtual
async def test_a_yes_to_a_start_on_several_robots_names_them_and_one_to_one_robot_starts_none() -> (
    None
):
    lab = Lab()
    async with lab.runner() as (control, queues):
        for name in ("Carol", "David"):
            demanding = Registration(name=name, profile={"second_person": True})
            await control.register(demanding, author(ANN))
            await until(lambda: control.robots.robot("David").heard_at is not None)
        await until(lambda: control.robots.robot("Carol").heard_at is not None)
        await control.rights.set_rules("Carol", Rules(limits=(LIMIT,)), OLGA)
        entry = await put(queues, both())
        one_robot = ordered(order(sequence("task")), entry.entered.digest, (), {})
        await control.approvals.give(ApprovalRequest(digest=one_robot.digest), author(BEN))
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await begun(queues, entry)
        looks = (await queues.look(entry.id, {}, BEN)).looks
        assert len({each.order for each in looks}) == 1
        words = [f"{each.what}: {each.text}" for each in looks[0].order]
        assert 'Robots: handed over whole to all of ["Carol","David"] at once' in words
        assert not any("one robot" in each for each in words)
        assert lab.david.starts == lab.carol.starts == []
        (digest,) = {each.order_digest for each in looks}
        await control.approvals.give(ApprovalRequest(digest=digest), author(BEN))
        assert len((await begun(queues, entry)).runs) == 2


@virtual
async def test_a_press_sent_again_says_too_which_robot_was_not_started() -> None:
    lab = Lab({"*": [{"after_s": 30}]})
    async with lab.runner() as (control, queues):
        entry = await put(queues, both())
        look = await queues.look(entry.id, {}, ANN)
        lab.harness.journal.slow = 0.5
        found: list[Grouped] = []

        async def press() -> None:
            started = await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
            assert isinstance(started, Grouped)
            found.append(started)

        async with anyio.create_task_group() as people:
            people.start_soon(press)
            await until(lambda: bool(lab.carol.starts))
            lab.harness.journal.down = True  # the start on David cannot be stored
        lab.harness.journal.slow, lab.harness.journal.down = 0.0, False
        await anyio.sleep(10)
        await press()
        for each in found:
            assert ([run.engine for run in each.runs], set(each.failed)) == (["Carol"], {"David"})
        assert (lab.david.starts, len(lab.carol.starts)) == ([], 1)
        control.stop_all(author(ANN))


@virtual
async def test_no_start_from_outside_takes_a_request_id_of_the_queue_or_of_a_repeat() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry, other = await put(queues, both()), await put(queues, on("David", "other"))
        ids = (*entry.entered.requests, *other.entered.requests, "repeat/r/1", "queue")
        for taken in ids:
            foreign = order(sequence("sim"), engine="simulator", request_id=taken)
            with pytest.raises(BadInput, match="is given by the runner alone") as refused:
                await control.start(foreign, author(BEN), BEN)
            assert refused.value.where == {"path": "/request_id"}
            group = group_of(foreign, ("Carol", "David"))
            group = msgspec.structs.replace(group, request_id=taken)
            with pytest.raises(BadInput, match="is given by the runner alone"):
                await control.start_group(group, author(BEN), BEN)
        assert queues.entries == (entry, other)
        assert len((await begun(queues, entry)).runs) == 2
