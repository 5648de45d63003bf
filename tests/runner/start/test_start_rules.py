"""Rules of owners about starts: robots that have to be watched, and where each way to start asks for it."""

import anyio
import pytest

from action_assistant.errors import BadInput, Conflict, Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Released, Requested, ResumeRequested
from action_assistant.runner.runs.views import run_view, time
from action_assistant.runner.start.admission import GoOnRequest, ResumeRequest
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_rights import SLOW, held
from runner.harness import Harness, ended, order, sequence, until, virtual
from runner.registered_robots import group
from runner.start.test_rights_registry import ANN, BEN, OLGA, author, david, lab

WATCHED = Rules(watched=True)


async def item(control: ExecutionService, code: str, **fields: object) -> tuple[str, str]:
    """Return verdict and text of an item of David's pre-flight."""
    (found,) = await control.look(group(sequence(), "David", **fields), "ann", ANN)
    return next((each.verdict, each.text) for each in found.items if each.code == code)


@virtual
async def test_nothing_starts_on_a_watched_robot_that_nobody_watches() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, WATCHED) as control:
        verdict, text = await item(control, "watched")
        assert (verdict, text) == (
            "blocked",
            "Say that you watch David, and that its hardware stop is within your reach.",
        )
        assert (await item(control, "watched", watching={"David": True}))[0] == "passed"
        for watching in ({}, {"David": False}):
            with pytest.raises(Conflict, match="Say that you watch David") as refused:
                await control.start(
                    order(sequence(), engine="David", watching=watching), author(ANN), ANN
                )
            assert (refused.value.where or {})["item"] == "watched"
        other = order(sequence(), engine="David", watching={"David": True, "Carol": True})
        with pytest.raises(BadInput, match="Nothing of this moves Carol"):
            await control.start(other, author(ANN), ANN)
        with pytest.raises(Refused, match="Say that you watch David"):
            await control.start_group(group(sequence(), "David"), author(ANN), ANN)
        assert robot.starts == []
        watched = order(sequence(), engine="David", watching={"David": True})
        run = (await control.start(watched, author(ANN), ANN)).run.id
        assert run_view(control.open[run].run).watching == ("David",)
        await control.stop(run, author(BEN))  # nothing is asked before a Stop
        await until(lambda: run not in control.open)
        assert run_view(await control.find(run)).watching == ("David",)
    (first,) = (each for each in harness.journal.told(run) if isinstance(each, Requested))
    assert first.watching == ("David",)


@virtual
async def test_the_simulator_asks_for_nobody_who_watches() -> None:
    harness = Harness({"David": david()})
    async with lab(harness, WATCHED) as control:
        run = (await control.start(order(sequence()), author(ANN), ANN)).run.id
        assert await ended(control, run) == "finished"
        asked = order(sequence(), watching={"David": True})
        with pytest.raises(BadInput, match="Nothing of this moves David"):
            await control.start(asked, author(ANN), ANN)


@virtual
async def test_a_rule_that_comes_while_a_start_is_stored_keeps_its_message_back() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, Rules()) as control:
        harness.journal.slow = 0.5
        found: list[str] = []

        async def begin() -> None:
            started = await control.start(order(sequence(), engine="David"), author(ANN), ANN)
            found.append(started.run.id)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(begin)
            await anyio.sleep(0.3)
            tasks.start_soon(control.rights.set_rules, "David", WATCHED, OLGA)
        harness.journal.slow = 0.0
        assert robot.starts == []
        run = await control.find(found[0])
        assert (run.end, "Say that you watch David" in run.detail) == ("refused", True)


@virtual
async def test_who_resumes_a_run_watches_its_robot_from_then_on() -> None:
    robot = david()
    robot.pauses = True
    harness = Harness({"David": robot})
    async with lab(harness, WATCHED) as control:
        watched = order(sequence(), engine="David", watching={"David": True})
        run = (await control.start(watched, author(ANN), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        await control.pause(run, author(ANN))
        await until(lambda: control.open[run].run.state == "paused")
        with pytest.raises(Conflict, match="Say that you watch David"):
            await control.resume(run, author(BEN), BEN)
        await control.resume(run, author(BEN), BEN, ResumeRequest({"David": True}))
        await control.stop(run, author(BEN))
        await until(lambda: run not in control.open)
    (told,) = (each for each in harness.journal.told(run) if isinstance(each, ResumeRequested))
    assert (told.author, told.watching) == (author(BEN), ("David",))


async def go_on(control: ExecutionService, run: str, *watched: str) -> None:
    found = control.open[run].run.held
    assert found is not None
    asked = GoOnRequest(time(found.at), watching=dict.fromkeys(watched, True))
    await control.go_on(run, asked, author(BEN), BEN)


@virtual
async def test_each_action_of_a_led_run_needs_somebody_who_watches_its_robot() -> None:
    lab_ = Lab(SLOW)
    async with lab_.runner() as control:
        await control.rights.set_rules("David", WATCHED, OLGA)
        graph = shared(sequence("task", 4), "Scout", "Carrier")
        with pytest.raises(Refused, match="David: Say that you watch David"):
            await control.start(led(graph), author(ANN), ANN)
        run = (await control.start(led(graph, watching={"David": True}), author(ANN), ANN)).run.id
        await until(lambda: lab_.harness.journal.history(run).actions["Work_0"].state == "RUNNING")
        await control.rights.set_rules("Carol", WATCHED, OLGA)
        sentence = "Nobody has said that they watch Carol with its hardware stop within reach."
        assert held(control, run) == sentence
        await anyio.sleep(30)
        assert (len(lab_.david.starts), len(lab_.carol.starts)) == (1, 0)
        with pytest.raises(Conflict, match="Say that you watch David"):
            await go_on(control, run, "Carol")
        await go_on(control, run, "Carol", "David")
        assert await ended(control, run) == "finished"
        assert (len(lab_.david.starts), len(lab_.carol.starts)) == (2, 2)
    (told,) = (each for each in lab_.harness.journal.told(run) if isinstance(each, Released))
    assert told.watching == ("Carol", "David")


@virtual
async def test_a_watched_run_that_is_handed_over_waits_for_its_new_person() -> None:
    lab_ = Lab(SLOW)
    async with lab_.runner() as control:
        await control.rights.set_rules("David", Rules(baton=True, watched=True), OLGA)
        await control.rights.take("David", ANN, author(ANN))
        graph = shared(sequence("task", 3), "Scout", "Carrier")
        run = (await control.start(led(graph, watching={"David": True}), author(ANN), ANN)).run.id
        await until(lambda: lab_.harness.journal.history(run).actions["Work_0"].state == "RUNNING")
        with control.rights.here(BEN):
            await control.hand_over(run, "ben", author(ANN), ANN)
        assert "Nobody has said that they watch David" in held(control, run)
        await go_on(control, run, "David")
        assert await ended(control, run) == "finished"
