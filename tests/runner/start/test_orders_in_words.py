"""A second person is shown the whole order in the runner's own words, and each other order needs another yes."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import Conflict
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.queues.entry import TurnRequest
from action_assistant.runner.repeats.repeat import Axis, ReopenRequest, Repeat, RepeatRequest
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.start.approvals import (
    ApprovalAsked,
    ApprovalQuestion,
    ApprovalRequest,
)
from action_assistant.runner.start.orders import InQueue, InRepeat, Ordered, ordered
from action_assistant.umrf.breakpoints import Breakpoint, ValueTest
from action_assistant.umrf.limits import Limit
from runner.harness import order, sequence, until, virtual
from runner.queues import test_queues as queued
from runner.registered_robots import group
from runner.repeats import test_repeats as repeated
from runner.repeats.test_repeats import on_david, opened, pressed
from runner.start.test_rights_registry import ANN, BEN, OLGA, author
from runner.start.test_start_values import asking

#: Texts that look alike where nothing tells what is not seen.
ALEPH = "\u05d0"
UNSEEN = (ALEPH, f"\u2068{ALEPH}\u2069", f"\u2068{ALEPH}", "\u202ea", "\\u202ea", "a\u200bb", "ab")
#: Values that each part of an order can have; the first is that of a plain start.
PARTS: dict[str, tuple[Any, ...]] = {
    "values": ({}, *({"Go_0": {"place": each}} for each in ("a", "b", 1.0, *UNSEEN))),
    "engine": ("David", "conducted"),
    "robots": ({"": "David"}, {"A": "David", "B": "simulator"}, {"A": "simulator", "B": "David"}),
    "lost": ("stop", "wait"),
    "script": (msgspec.Raw(), msgspec.Raw(b'{"*":[{"result":"on_false"}]}')),
    "people": ({}, {"operator": ""}, {"operator": "ben"}),
    "codes": ((), ("H12",), ("H12", "others")),
    "limits": (
        {},
        {"David": (Limit(parameter="torque", most=60.0),)},
        {"David": (Limit(parameter="torque", least=60.0),)},
        {"David": (Limit(parameter="torque", action="Grip", most=60.00001),)},
    ),
    "start_from": (
        None,
        StartFrom(run="r"),
        StartFrom(run="r", choices={"Go": "again"}),
        StartFrom(at=("Go",), only=True),
        *(StartFrom(at=("Go",), run="r", reason=each) for each in ("seen", *UNSEEN)),
    ),
    "breakpoints": (
        (),
        (Breakpoint(action="Go", to="Grip"),),
        (Breakpoint(action="Go", to="Grip", outcomes=("true",)),),
        (Breakpoint(action="Go at visit 2"),),
        (Breakpoint(action="Go"),),
        (Breakpoint(action="Go", visit=2),),
        (Breakpoint(action="Go", visit=3),),
        (Breakpoint(action="Go", outcomes=("true",)),),
        (Breakpoint(action="Go", inside="Sub"),),
        (Breakpoint(action="Go", value=ValueTest("x", "<", 2.0)),),
        (Breakpoint(action="Go", value=ValueTest("x", "<", 3.0)),),
        (Breakpoint(action="Go", visit=2, value=ValueTest("x", "<", 2.0), inside="Sub"),),
    ),
    "levels": ("one_step", "opened"),
    "often": (
        None,
        InQueue("e", 1_000_000),
        InQueue("e", 1_000_001),
        *(
            InRepeat(repeat="x", closings=n, since=at, times=2, grid=grid, seed=seed, values={})
            for n, at, grid, seed in (
                (0, 1, (), None),
                (1, 1, (), None),
                (0, 2, (), None),
                (0, 1, (("A", "b", (1.0, 2.0)),), 4),
            )
        ),
    ),
    "together": ((), ("Carol", "David"), ("David", "Ed")),
    "tree": ("a" * 64, "b" * 64),
}
CHOICES = st.fixed_dictionaries({name: st.sampled_from(each) for name, each in PARTS.items()})


def made_of(chosen: dict[str, Any]) -> Ordered:
    more = ("codes", "limits", "often", "together", "tree")
    fields = {name: each for name, each in chosen.items() if name not in more}
    if chosen["engine"] != "conducted":
        fields |= {"robots": {}, "people": {}, "levels": "one_step"}
    start = msgspec.structs.replace(order(sequence()), **fields)
    together = chosen["together"] if chosen["engine"] != "conducted" else ()
    rest = (chosen[each] for each in ("tree", "codes", "limits", "often"))
    return ordered(start, *rest, together)


def shown(text: str) -> str:
    """A text without the isolates in which a word from right to left stands."""
    return text.replace(f"\u2068{ALEPH}\u2069", ALEPH)


@given(CHOICES, st.data())
def test_two_orders_have_the_same_words_exactly_if_they_have_the_same_digest(
    chosen: dict[str, Any], data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(sorted(PARTS)))
    one = made_of(chosen)
    other = made_of(chosen | {name: data.draw(st.sampled_from(PARTS[name]))})
    assert (one.lines == other.lines) == (one.digest == other.digest)
    assert all(shown(each.text).isprintable() for each in one.lines)


@pytest.mark.parametrize("engine", ["David", "conducted"])
@pytest.mark.parametrize("name", [each for each in PARTS if each != "engine"])
def test_each_part_of_an_order_is_told_from_its_others(engine: str, name: str) -> None:
    plain = {part: each[0] for part, each in PARTS.items()} | {"engine": engine}
    plain["robots"] = PARTS["robots"][1]
    orders = [made_of(plain | {name: each}) for each in PARTS[name]]
    assert len({each.lines for each in orders}) == len({each.digest for each in orders})


async def demanding(control: ExecutionService) -> None:
    await control.register(Registration(name="David", profile={"second_person": True}), author(ANN))
    await until(lambda: control.robots.robot("David").heard_at is not None)


async def said_yes(control: ExecutionService, digest: str) -> None:
    await control.approvals.give(ApprovalRequest(digest=digest), author(BEN))


async def wanted(control: ExecutionService, digest: str, graph: str | None) -> ApprovalAsked:
    question = ApprovalQuestion(digest=digest, robots=("David",), graph_name="x", graph=graph)
    return await control.approvals.ask(question, author(ANN))


@virtual
async def test_a_question_carries_the_words_of_the_runners_own_look_and_none_of_its_asker() -> None:
    lab = repeated.Lab()
    async with lab.runner() as (control, _):
        await demanding(control)
        limit = Limit(parameter="torque", most=60.0)
        await control.rights.set_rules("David", Rules(limits=(limit,)), OLGA)
        values = {"Work_1": {"place": "valve_8", "torque": 3.0}}
        asked = msgspec.structs.replace(group(asking(), "David", values=values), graph="g1")
        (look,) = await control.look(asked, "ann")
        words = [f"{each.what}: {each.text}" for each in look.order]
        assert '"place" of "Work_1" = "valve_8"' in " ".join(words)
        assert 'Limit: "David": "torque", at most 60.0' in words
        question = await wanted(control, look.order_digest, "g1")
        assert (question.order, question.tree_digest) == (look.order, look.tree_digest)
        (kept,) = await control.approvals.questions_of("g1")
        assert kept.order == look.order
        # Under the name of another graph nobody learns its words, and what nobody has looked at has none.
        assert (await wanted(control, "c" * 64, "g1")).order == ()
        control.approvals._asked.clear()
        assert (await wanted(control, look.order_digest, "g2")).order == ()


async def digest_of_next(repeats: Any, repeat: Repeat) -> str:
    return next(
        each.order_digest for each in await repeats.look(repeat.id, {}, ANN) if each.order_digest
    )


@virtual
async def test_one_yes_covers_exactly_one_repeat_with_its_runs_until_a_doubt_closes_it() -> None:
    lab = repeated.Lab()
    async with lab.runner() as (control, repeats):
        await demanding(control)
        request = on_david()
        await said_yes(control, request.start.digest)  # to single starts of the same
        repeat = await opened(repeats, request)
        with pytest.raises(Conflict, match="nobody else has said yes to exactly this repeat"):
            await pressed(repeats, repeat, 1)
        assert lab.david.starts == []
        await said_yes(control, await digest_of_next(repeats, repeat))
        for cell in (1, 2):
            await repeated.over(control, await pressed(repeats, repeat, cell))
        assert len(lab.david.starts) == 2
        again = await opened(
            repeats, on_david(start=order(sequence(), request_id="again", engine="David"))
        )
        with pytest.raises(Conflict, match="nobody else has said yes to exactly this repeat"):
            await pressed(repeats, again, 1)
        await repeats.close(repeat.id, author(ANN))
        await repeats.reopen(repeat.id, ReopenRequest(1), author(ANN), ANN)  # it starts nothing
        with pytest.raises(Conflict, match="nobody else has said yes to exactly this repeat"):
            await pressed(repeats, repeat, 3)
        assert len(lab.david.starts) == 2
        await said_yes(control, await digest_of_next(repeats, repeat))
        await repeated.over(control, await pressed(repeats, repeat, 3))
        assert len(lab.david.starts) == 3
        assert await repeats.look(repeat.id, {}, ANN) == []


@virtual
async def test_a_yes_to_a_repeat_covers_all_its_values_and_no_others() -> None:
    lab = repeated.Lab()
    async with lab.runner() as (control, repeats):
        await demanding(control)
        start = order(asking(), request_id="grid", engine="David")
        torque = {"Work_1": {"torque": 3.0}}
        start = msgspec.structs.replace(start, values=torque)
        places = Axis("Work_1", "place", ("valve_7", "valve_8"))
        repeat = await opened(repeats, RepeatRequest(start=start, grid=(places,)))
        looks = await repeats.look(repeat.id, {}, BEN)
        words = " ".join(each.text for look in looks for each in look.order)
        assert '"place" of "Work_1" = each of ["valve_7","valve_8"]' in words
        assert '"torque" of "Work_1" = 3.0' in words
        await said_yes(control, await digest_of_next(repeats, repeat))
        for cell in (1, 2):
            await repeated.over(control, await pressed(repeats, repeat, cell))
        assert len(lab.david.starts) == 2


@virtual
async def test_a_yes_at_a_turn_of_the_queue_is_for_that_turn_and_for_nothing_else() -> None:
    lab = queued.Lab()
    async with lab.runner() as (control, queues):
        await demanding(control)
        first = await queued.put(queues, queued.on("David"))
        second = await queued.put(queues, queued.on("David"))
        look = await queues.look(first.id, {}, BEN)
        (digest,) = {each.order_digest for each in look.looks}
        await said_yes(control, digest)
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await control.start(order(sequence("task"), engine="David"), author(ANN), ANN)
        queues.close("David", author(ANN))
        await queued.reopened(queues, "David", ANN)  # its turn comes anew: a doubt was in between
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await queued.started(queues, first)
        look = await queues.look(first.id, {}, BEN)
        await said_yes(control, look.looks[0].order_digest)
        asked = TurnRequest((await queues.look(first.id, {}, ANN)).digest)
        run = (await queues.start(first.id, asked, author(ANN), ANN)).run.id
        await queued.over(control, run)
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await queued.started(queues, second)
        await said_yes(control, order(sequence("task")).digest)  # to each start of exactly this
        await queued.started(queues, second)
        assert len(lab.david.starts) == 2


@virtual
async def test_a_yes_to_a_closed_repeat_counts_no_more_after_another_doubt() -> None:
    for again in (False, True):
        lab = repeated.Lab()
        async with lab.runner() as (control, repeats):
            await demanding(control)
            repeat = await opened(repeats, on_david())
            await repeats.close(repeat.id, author(ANN))
            seen = (await repeats.find(repeat.id)).closings
            await said_yes(control, await digest_of_next(repeats, repeat))
            if again:
                control.stop_robot("David", OLGA)
            await repeats.reopen(repeat.id, ReopenRequest(seen), author(ANN), ANN)
            if not again:
                await pressed(repeats, repeat, 1)
                continue
            with pytest.raises(Conflict, match="nobody else has said yes to exactly this repeat"):
                await pressed(repeats, repeat, 1)
            assert lab.david.starts == []


@virtual
async def test_a_yes_to_a_closed_repeat_counts_no_more_after_a_restart_with_doubts_before() -> None:
    lab = repeated.Lab()
    async with lab.runner() as (control, repeats):
        await demanding(control)
        repeat = await opened(repeats, on_david())
        await repeats.close(repeat.id, author(ANN))
        await said_yes(control, await digest_of_next(repeats, repeat))
        control.stop_robot("David", OLGA)
    async with lab.runner() as (control, repeats):
        await until(lambda: control.robots.robot("David").heard_at is not None)
        seen = (await repeats.find(repeat.id)).closings
        await repeats.reopen(repeat.id, ReopenRequest(seen), author(ANN), ANN)
        with pytest.raises(Conflict, match="nobody else has said yes to exactly this repeat"):
            await pressed(repeats, repeat, 1)
        assert lab.david.starts == []
