"""A robot that demands a second person takes only what somebody else has said yes to."""

import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import httpx
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict, TooMany
from action_assistant.journal.events import Draft
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import SIMULATOR, Leaves, Order, Registration, unwatched
from action_assistant.runner.runs.events import Author, Override
from action_assistant.runner.start.approvals import (
    STREAM,
    ApprovalGiven,
    ApprovalQuestion,
    ApprovalRequest,
    Approvals,
)
from action_assistant.runner.start.orders import ordered
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.facts import BadProfile, facts_of
from action_assistant.web.auth.caller import Caller, set_caller
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.roles import Role
from runner.execution.test_conductor import shared
from runner.harness import ANN, BEN, Harness, clock_us, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, change, fleet, group, verdicts
from support.product import TOKEN, running

CARL = Author("carl", "Carl")


@asynccontextmanager
async def careful(
    harness: Harness, david: Open, now: IdentityNow = unchanged
) -> AsyncIterator[ExecutionService]:
    """A runner whose robot demands a second person."""
    async with fleet(harness, now, David=david) as control:
        demanding = Registration(name="David", profile={"second_person": True})
        await control.register(demanding, ANN)
        await until(lambda: control.robots.robot("David").heard_at is not None)
        yield control


def yes(digest: str) -> ApprovalRequest:
    return ApprovalRequest(digest=digest)


@virtual
async def test_no_start_before_a_second_person_has_approved() -> None:
    david, graph = Open(NEVER), sequence()
    async with careful(Harness(), david) as control:
        asked = order(graph, engine="David")
        (look,) = await control.look(group(graph, "David"), "ann")
        assert (verdicts(look)["approved"], look.never) == ("blocked", True)
        override = Override(("approved",), "I am careful")
        for tried in (asked, msgspec.structs.replace(asked, override=override)):
            with pytest.raises(Conflict, match="second person") as refused:
                await control.start(tried, ANN)
            assert (refused.value.where or {})["item"] == "approved"
        with pytest.raises(Conflict, match="second person"):
            await control.start_group(group(graph, "David"), ANN)
        assert david.starts == []

        await control.approvals.give(yes(asked.digest), ANN)  # her own does not count
        with pytest.raises(Conflict, match="nobody else"):
            await control.start(asked, ANN)
        await control.approvals.give(yes(asked.digest), BEN)
        (look,) = await control.look(group(graph, "David"), "ann")
        approved = next(item for item in look.items if item.code == "approved")
        assert (approved.verdict, approved.text) == (
            "passed",
            "Ben said yes to exactly this graph.",
        )
        assert (await control.start(asked, ANN)).fresh
        assert len(david.starts) == 1
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_yes_is_to_exactly_one_graph() -> None:
    david = Open()
    async with careful(Harness(), david) as control:
        await control.approvals.give(yes(order(sequence(actions=2)).digest), BEN)
        with pytest.raises(Conflict, match="nobody else"):
            await control.start(order(sequence(actions=3), engine="David"), ANN)
    assert david.starts == []


@pytest.mark.parametrize(
    "change",
    [
        {"script": {"*": [{"result": "on_false"}]}},
        {"breakpoints": ()},
        {"lost": "wait"},
        {"robots": {"Scout": "simulator", "Carrier": "David"}},
    ],
    ids=lambda change: "+".join(change),
)
def test_a_yes_is_to_the_whole_order_of_a_led_run(change: dict[str, Any]) -> None:
    graph = shared(sequence("task", 2), "Scout", "Carrier")
    whole: dict[str, Any] = {
        "engine": "conducted",
        "robots": {"Scout": "simulator", "Carrier": "Carol"},
        "script": {"*": [{"result": "on_true"}]},
        "breakpoints": (Breakpoint(action="Work_1"),),
    }
    one, other = order(graph, **whole), order(graph, **(whole | change))
    first, changed, again = (
        ordered(each, one.digest, (), {}).digest for each in (one, other, order(graph, **whole))
    )
    assert changed != first == again


@virtual
async def test_a_change_of_what_runs_is_asked_for_like_a_start() -> None:
    class Pausing(Open):
        pauses = True
        modified: tuple[Order, ...] = ()

        async def modify(
            self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
        ) -> None:
            """Remember the order instead of sending it."""
            self.modified = (*self.modified, order)

    david, first, second = Pausing(NEVER), sequence(), sequence(actions=4)
    async with careful(Harness(), david) as control:
        await control.approvals.give(yes(order(first).digest), BEN)
        run = (await control.start(order(first, engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        with pytest.raises(Conflict, match="second person"):
            await control.modify(run.id, change(second), ANN)
        assert david.modified == ()
        await control.approvals.give(yes(order(second).digest), CARL)
        with pytest.raises(Conflict, match="nobody else"):
            await control.modify(run.id, change(second), CARL)
        await control.modify(run.id, change(second), ANN)
        assert len(david.modified) == 1
        control.stop_all(ANN)
        await until(lambda: not control.open)


@pytest.mark.parametrize(
    "more",
    [{"continue_from": "Work_3"}, {"override": {"codes": ["no_result"], "reason": "I know"}}],
)
@virtual
async def test_a_yes_to_a_version_covers_no_change_that_does_more(more: dict[str, Any]) -> None:
    class Pausing(Open):
        pauses = True

    david, first, second = Pausing(NEVER), sequence(), sequence(actions=4)
    async with careful(Harness(), david) as control:
        await control.approvals.give(yes(order(first).digest), BEN)
        run = (await control.start(order(first, engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        await control.approvals.give(yes(order(second).digest), BEN)
        body = msgspec.json.encode(msgspec.json.decode(change(second)) | more)
        with pytest.raises(Conflict, match="nobody else has said yes to exactly this start"):
            await control.modify(run.id, body, ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


def test_a_change_that_goes_on_elsewhere_says_so_in_its_words() -> None:
    asked = order(sequence())
    plain = ordered(asked, asked.digest, (), {})
    assert plain.going_on("") == plain
    other = plain.going_on("Work_3")
    assert other.digest != plain.digest
    assert ("Goes on", 'from "Work_3", in a running graph') in [
        (line.what, line.text) for line in other.lines
    ]


@pytest.mark.parametrize(
    "unseen", list("\u3164\u2800\u115f\ufe0f\u034f\u180b\U000e0100\uffa0\u200b")
)
def test_the_words_of_an_order_show_what_nobody_sees(unseen: str) -> None:
    asked = msgspec.structs.replace(order(sequence()), values={"Work_0": {"place": f"a{unseen}"}})
    found = [line.text for line in ordered(asked, asked.digest, (), {}).lines]
    assert not any(unseen in text for text in found)
    assert any("\\u" in text for text in found)


@virtual
async def test_a_yes_that_is_given_again_where_it_counts_counts() -> None:
    """Ben says yes in Ann's browser, which counts for nothing, and then in his own."""
    david, graph = Open(NEVER), sequence()
    async with careful(Harness(), david) as control:
        asked = order(graph, engine="David")
        set_caller(Caller("ann", "1.2.3.4", device="Ann's"))
        await control.approvals.give(yes(asked.digest), BEN)
        with pytest.raises(Conflict, match="came from the browser that you use"):
            await control.start(asked, ANN)
        set_caller(Caller("ben", "1.2.3.5", device="Ben's"))
        given = await control.approvals.give(yes(asked.digest), BEN)
        assert await control.approvals.give(yes(asked.digest), BEN) == given
        set_caller(Caller("ann", "1.2.3.4", device="Ann's"))
        assert (await control.start(asked, ANN)).fresh
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_damaged_yes_keeps_no_other_from_counting() -> None:
    harness = Harness()
    damaged = Draft(ApprovalGiven.kind, "x", b'{"at": 1}')
    await harness.journal.append(STREAM, [damaged])
    approvals = Approvals(harness.journal, clock_us)
    given = await approvals.give(yes("a" * 64), BEN)
    assert await approvals.given_for("a" * 64) == (given,)


@virtual
async def test_the_simulator_and_other_robots_ask_nobody() -> None:
    async with fleet(Harness(), David=Open()) as control:
        for engine in ("David", SIMULATOR):
            (look,) = await control.look(group(sequence(), engine), "ann")
            assert "approved" not in verdicts(look)


@virtual
async def test_a_yes_is_kept_once_and_after_a_restart() -> None:
    harness = Harness()
    digest = order(sequence()).digest
    async with fleet(harness, David=Open()) as control:
        first = await control.approvals.give(yes(digest), BEN)
        assert await control.approvals.give(yes(digest), BEN) == first
        await control.approvals.give(yes(digest), CARL)
        with pytest.raises(BadInput, match="no digest"):
            await control.approvals.give(yes("x" * 64), BEN)
    events = await harness.journal.read(STREAM)
    assert [event.kind for event in events] == [ApprovalGiven.kind] * 2
    again = Approvals(harness.journal, clock_us)
    assert [each.author for each in await again.given_for(digest)] == [BEN, CARL]


@given(st.sampled_from(["yes", 1, None, []]))
def test_a_profile_demands_it_or_not(value: object) -> None:
    facts_of({"second_person": True})
    with pytest.raises(BadProfile) as wrong:
        facts_of({"second_person": value})
    assert wrong.value.path == "/second_person"


@virtual
async def test_who_came_by_a_link_for_several_people_is_no_second_person() -> None:
    david, graph = Open(NEVER), sequence()
    async with careful(Harness(), david) as control:
        asked = order(graph, engine="David")
        await control.approvals.give(yes(asked.digest), BEN, is_named=False)
        with pytest.raises(Conflict, match="Ben came by a link that several people may use"):
            await control.start(asked, ANN)
        assert david.starts == []
        await control.approvals.give(yes(asked.digest), CARL)
        assert (await control.start(asked, ANN)).fresh
        control.stop_all(ANN)
        await until(lambda: not control.open)


async def test_a_yes_of_before_links_were_told_apart_counts() -> None:
    old = b'{"at":1,"digest":"x","author":{"id":"ben","name":"Ben","by":"browser"}}'
    assert msgspec.json.decode(old, type=ApprovalGiven).is_named is None


@virtual
async def test_a_yes_from_the_same_browser_under_another_name_is_no_second_person() -> None:
    david, graph = Open(NEVER), sequence()

    def asks(author: Author, device: str) -> None:
        set_caller(Caller(author.id, device=device))

    async with careful(Harness(), david) as control:
        asked = order(graph, engine="David")
        asks(BEN, "tablet")
        await control.approvals.give(yes(asked.digest), BEN)
        asks(ANN, "tablet")
        with pytest.raises(Conflict, match="came from the browser that you use"):
            await control.start(asked, ANN)
        (look,) = await control.look(group(graph, "David"), "ann")
        assert verdicts(look)["approved"] == "blocked"
        assert david.starts == []
        asks(ANN, "desk")
        assert (await control.start(asked, ANN)).fresh
        control.stop_all(ANN)
        await until(lambda: not control.open)


@pytest.mark.usefixtures("new_interpreters")  # forks have no rclpy, so no robot for the check
def test_a_browser_is_known_again_by_both_processes_after_somebody_has_signed_out(
    tmp_path: Path,
) -> None:
    graph = json.loads(bytes(order(sequence()).umrf))
    with (
        running(tmp_path / "data") as product,
        httpx.Client(trust_env=False, timeout=60) as browser,
    ):
        browser.headers["origin"] = product.url
        program = {"authorization": f"Bearer {TOKEN}"}
        robot = {"name": "David", "domain": 180, "profile": {"second_person": True}}
        made = httpx.post(
            f"{product.runner_url}/api/robots", json=robot, headers=program, trust_env=False
        )
        assert made.is_success, made.text

        def signed_in(name: str) -> None:
            member = {"name": name, "role": "operator"}
            added = httpx.post(
                f"{product.url}/api/members", json=member, headers=program, trust_env=False
            )
            proof = added.json()["links"][0]["path"].removeprefix("/#i=")
            answer = browser.post(f"{product.url}/api/session", json={"invitation": proof})
            assert answer.is_success, answer.text

        def approved(digest: str = "") -> tuple[str, dict[str, str]]:
            asked = {"umrf": graph, "engines": ["David"]}
            answer = browser.post(f"{product.runner_url}/api/preflight", json=asked)
            assert answer.is_success, answer.text
            (look,) = answer.json()
            return look["tree_digest"], next(i for i in look["items"] if i["code"] == "approved")

        signed_in("Ben")
        digest, item = approved()
        assert browser.post(
            f"{product.runner_url}/api/approvals", json={"digest": digest}
        ).is_success
        assert browser.delete(f"{product.url}/api/session").is_success
        signed_in("Ann")
        _, item = approved()
        assert item["verdict"] == "blocked"
        assert "the yes of Ben came from the browser that you use" in item["text"]
        browser.cookies.clear()
        signed_in("Carl")
        assert approved()[1]["verdict"] == "passed"


@virtual
async def test_nobody_approves_or_asks_without_end() -> None:
    """Nobody is kept from it by others, nor by asking about another robot."""
    harness = Harness()
    approvals = Approvals(harness.journal, clock_us)

    def question(number: int, robot: str) -> ApprovalQuestion:
        return ApprovalQuestion(digest=f"{number:064x}", robots=(robot,), graph_name="Fetch")

    async def stored() -> int:
        return len(await harness.journal.read(STREAM, limit=1000))

    async def refused(again: Callable[[int], Awaitable[object]]) -> str:
        for number in range(1000):
            try:
                await again(number)
            except TooMany as why:
                return why.detail
        return ""

    why = await refused(lambda number: approvals.give(yes(f"{number:064x}"), ANN))
    assert "very many graphs" in why
    given = await stored()
    why = await refused(lambda number: approvals.ask(question(number, "David"), ANN))
    assert "very often about David" in why
    asked = await stored() - given
    assert (0 < given < 100, 0 < asked < 50) == (True, True)
    assert (await approvals.give(yes("0" * 64), ANN)).author == ANN  # that stands already
    await approvals.give(yes("f" * 64), BEN)
    await approvals.ask(question(999, "Carol"), ANN)
    await approvals.ask(question(1, "David"), BEN)
    assert await stored() == given + asked + 3


@virtual
async def test_a_question_is_shown_with_its_values_for_a_day() -> None:
    harness = Harness()
    now = [1]
    approvals = Approvals(harness.journal, lambda: now[0])
    values = {"Go_0": {"place": "valve_8"}}
    asked = ApprovalQuestion(
        digest="a" * 64, robots=("David",), graph_name="Fetch", graph="g1", values=values
    )
    await approvals.ask(asked, ANN)
    await approvals.ask(msgspec.structs.replace(asked, digest="b" * 64, values={}), BEN)
    found = await Approvals(harness.journal, lambda: now[0]).questions_of("g1")
    assert [(each.author, each.values) for each in found] == [(BEN, {}), (ANN, values)]
    assert await approvals.questions_of("g2") == ()
    now[0] += 86_400_000_001
    assert await approvals.questions_of("g1") == ()
    large = msgspec.structs.replace(asked, values={"Go_0": {"place": "x" * 70_000}})
    with pytest.raises(BadInput, match="bytes"):
        await approvals.ask(large, ANN)


@virtual
async def test_a_yes_counts_only_while_its_person_may_still_give_it() -> None:
    david, graph, roles = Open(NEVER), sequence(), dict[str, Role | None]()

    def now(identity: Identity) -> Identity | None:
        role = roles.get(identity.person.id, identity.person.role)
        if role is None:
            return None
        person = msgspec.structs.replace(identity.person, role=role)
        return msgspec.structs.replace(identity, person=person)

    async with careful(Harness(), david, now) as control:
        start = order(graph, engine="David")
        await control.approvals.give(yes(start.digest), BEN)
        lost: tuple[Role | None, ...] = ("viewer", "editor", None)
        for role in lost:
            roles["ben"] = role
            (look,) = await control.look(group(graph, "David"), "ann")
            assert verdicts(look)["approved"] == "blocked"
            with pytest.raises(Conflict, match="Ben, who did, may not say so any more"):
                await control.start(start, ANN)
            assert david.starts == []
        roles["ben"] = "operator"
        assert (await control.start(start, ANN)).fresh
        control.stop_all(ANN)


@virtual
async def test_a_yes_that_counts_no_more_when_the_message_leaves_lets_nothing_leave() -> None:
    for is_led in (False, True):
        david, harness, roles = Open(NEVER), Harness(), dict[str, Role]()

        def now(identity: Identity, roles: dict[str, Role] = roles) -> Identity:
            role = roles.get(identity.person.id, identity.person.role)
            person = msgspec.structs.replace(identity.person, role=role)
            return msgspec.structs.replace(identity, person=person)

        async with careful(harness, david, now) as control:
            demanding = control.robots.registration("David")
            await control.register(msgspec.structs.replace(demanding, led=True), ANN)
            cast = {"engine": "conducted", "robots": {"": "David"}}
            start = order(sequence(), **(cast if is_led else {"engine": "David"}))
            await control.approvals.give(yes(ordered(start, start.digest, (), {}).digest), BEN)
            harness.journal.slow = 1.0
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(control.start, start, ANN)
                await anyio.sleep(0.7)  # accepted, and being stored
                roles["ben"] = "viewer"
            harness.journal.slow = 0.0
            await until(lambda: not control.open)
            (run,) = [name for name in harness.journal.streams if name.startswith("run/")]
            ended = harness.journal.history(run.removeprefix("run/"))
            assert (ended.state, david.starts) == ("refused", [])
            assert "Ben, who did, may not say so any more" in ended.detail
