"""Batons and rights in led runs: what closes the gate, who opens it, and that it stops nothing."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Forbidden, Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.robots.rights import Operator, Rules
from action_assistant.runner.runs.events import HandedOver
from action_assistant.runner.runs.views import run_view, time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest
from action_assistant.web.auth.identity import Identity
from runner.execution.test_conductor import Lab, led, shared
from runner.harness import clock_us, ended, sequence, until, virtual
from runner.start.test_rights_registry import (
    ANN,
    BATON,
    BEN,
    CARL,
    OLGA,
    Ended,
    author,
)

SLOW = {"*": [{"after_s": 5}]}
ASKS = Rules(ask_again=10)


async def batons(control: ExecutionService, *robots: str, by: Identity = ANN) -> None:
    """Give these robots a baton, which a person holds."""
    for robot in robots:
        await control.rights.set_rules(robot, BATON, OLGA)
        await control.rights.take(robot, by, author(by))


async def begin(
    lab: Lab, control: ExecutionService, *, actions: int = 4, lost: str = "stop"
) -> str:
    """Start a run of Ann's that alternates between the robots, and wait until its first action moves."""
    request = led(shared(sequence("task", actions), "Scout", "Carrier"), lost=lost)
    run = (await control.start(request, author(ANN), ANN)).run.id
    await until(lambda: lab.harness.journal.history(run).actions["Work_0"].state == "RUNNING")
    return run


def held(control: ExecutionService, run: str) -> str:
    """Return why a run is held; "" if it is not."""
    opened = control.open.get(run)
    found = None if opened is None else opened.run.held
    return "" if found is None else found.why


async def go_on(control: ExecutionService, run: str, by: Identity) -> None:
    found = control.open[run].run.held
    assert found is not None
    await control.go_on(run, GoOnRequest(time(found.at)), author(by), by)


def sent(lab: Lab) -> int:
    return len(lab.david.starts) + len(lab.carol.starts)


@virtual
async def test_a_led_start_needs_the_baton_of_each_robot_that_moves() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David")
        await control.rights.set_rules("Carol", BATON, OLGA)
        request = led(shared(sequence("task", 2), "Scout", "Carrier"))
        with pytest.raises(Refused, match="Carol: Nobody holds the baton of Carol"):
            await control.start(request, author(ANN), ANN)
        same = ("umrf", "version", "digest", "robots", "lost", "graph")
        fields = {each: getattr(request, each) for each in same}
        looks = await control.look(GroupRequest(**fields, engines=("conducted",)), "ann", ANN)
        items = {each.engine: {i.code: i.verdict for i in each.items} for each in looks}
        assert (items["David"]["baton"], items["Carol"]["baton"]) == ("passed", "blocked")
        assert sent(lab) == 0


@pytest.mark.parametrize("lost", ["stop", "wait"])
@virtual
async def test_a_baton_that_changes_hands_holds_the_run_until_the_new_holder_lets_it_go_on(
    lost: str,
) -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control, lost=lost)
        with control.rights.here(BEN):
            await control.rights.hand("Carol", "ben", ANN, author(ANN))
        assert "Ann may not start on Carol: Ben has its baton" in held(control, run)
        await anyio.sleep(30)
        assert sent(lab) == 1
        found = control.open[run].run
        assert (found.desired, found.end) == ("running", None)  # it waits, and is not stopped
        assert found.actions["Work_0"].state == "FINISHED"  # what was begun went on
        for nobody in (ANN, BEN, CARL):  # no one of them holds both batons
            with pytest.raises(Conflict, match="has its baton"):
                await go_on(control, run, nobody)
        await control.rights.take("David", BEN, author(BEN), "Ann has left.")
        with pytest.raises(Conflict):
            await go_on(control, run, ANN)
        await go_on(control, run, BEN)
        assert await ended(control, run) == "finished"
        assert sent(lab) == 4
        assert run_view(await control.find(run)).lead == author(BEN)


@virtual
async def test_a_baton_that_falls_and_comes_back_to_its_holder_opens_nothing_by_itself() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control)
        await control.rights.drop("Carol", ANN, author(ANN))
        await control.rights.take("Carol", ANN, author(ANN))
        await anyio.sleep(30)
        assert sent(lab) == 1
        await go_on(control, run, ANN)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_run_that_is_handed_over_with_all_its_batons_goes_on() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control)
        with pytest.raises(Conflict, match="no page open"):
            await control.hand_over(run, "ben", author(ANN), ANN)
        with control.rights.here(BEN):
            with pytest.raises(Conflict, match="not you"):
                await control.hand_over(run, "ben", author(CARL), CARL)
            lab.harness.journal.slow = 0.3
            await control.hand_over(run, "ben", author(ANN), ANN)
            lab.harness.journal.slow = 0.0
        for robot in ("David", "Carol"):
            holder = control.rights.holder(robot)
            assert holder is not None
            assert holder.person.id == "ben"
        assert held(control, run) == ""
        assert await ended(control, run) == "finished"
        assert sent(lab) == 4
        (over,) = (each for each in lab.harness.journal.told(run) if isinstance(each, HandedOver))
        assert (over.author, over.to) == (author(ANN), author(BEN))


@virtual
async def test_a_run_handed_over_again_and_again_is_never_held_and_begins_each_action_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lab = Lab({"*": [{"after_s": 0.3}]})
    journal = lab.harness.journal
    append = journal.append

    async def appended(stream: str, *rest: Any, **more: Any) -> int:
        """Batons are stored later than all else, so that pieces would begin in between."""
        if stream.startswith("robot/"):
            await anyio.sleep(0.2)
        return await append(stream, *rest, **more)

    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        monkeypatch.setattr(journal, "append", appended)
        with control.rights.here(ANN), control.rights.here(BEN):
            run = await begin(lab, control, actions=40)
            giver, taker = ANN, BEN
            while run in control.open and control.open[run].run.end is None:
                try:
                    await control.hand_over(run, taker.person.id, author(giver), giver)
                except Conflict:
                    break  # it is over
                assert held(control, run) == ""
                giver, taker = taker, giver
                await anyio.sleep(0.07)
            assert await ended(control, run) == "finished"
        assert sent(lab) == 40
        over = [each for each in lab.harness.journal.told(run) if isinstance(each, HandedOver)]
        assert len(over) > 20


@virtual
async def test_a_run_is_not_handed_over_to_somebody_who_may_not_start_on_all_its_robots() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David")
        only = Rules(operators=(Operator("ann", "Ann"),))
        await control.rights.set_rules("Carol", only, OLGA)
        run = await begin(lab, control)
        with control.rights.here(BEN), pytest.raises(Forbidden, match="on Carol: only Ann may"):
            await control.hand_over(run, "ben", author(ANN), ANN)
        holder = control.rights.holder("David")
        assert holder is not None
        assert holder.person.id == "ann"
        assert held(control, run) == ""
        assert await ended(control, run) == "finished"


@pytest.mark.parametrize("lost", ["stop", "wait"])
@virtual
async def test_a_starter_whose_right_ends_begins_nothing_further_and_stops_nothing(
    lost: str,
) -> None:
    lab, over = Lab(SLOW), Ended()
    async with lab.runner(over) as control:
        run = await begin(lab, control, lost=lost)
        over.sessions.add("s_ann")  # ended, without a baton to fall
        await until(lambda: held(control, run) != "")
        assert held(control, run) == "Ann is not signed in any more."
        await anyio.sleep(20)
        found = control.open[run].run
        assert (found.desired, found.end, sent(lab)) == ("running", None, 1)
        await go_on(control, run, BEN)  # for another person
        await until(lambda: sent(lab) == 2)
        rules = Rules(operators=(Operator("ben", "Ben", time_us(control) + 2_000_000),))
        await control.rights.set_rules("David", rules, OLGA)
        assert held(control, run) == ""
        await until(lambda: held(control, run) != "")
        assert "Ben may not start on David any more" in held(control, run)
        assert len(lab.carol.starts) == 1
        assert control.open[run].run.desired == "running"
        assert await control.stop(run, author(CARL)) == [run]
        assert await ended(control, run) in {"stopped", "halted"}


def time_us(control: ExecutionService) -> int:
    return control._runtime.clock_us()


@virtual
async def test_a_robot_out_of_service_holds_the_led_runs_there_and_stop_works() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        run = await begin(lab, control)
        await control.rights.lock("Carol", CARL, author(CARL), "It leaks oil.")
        assert "Carol is out of service" in held(control, run)
        await anyio.sleep(20)
        assert sent(lab) == 1
        with pytest.raises(Conflict, match="out of service"):
            await go_on(control, run, ANN)
        await control.rights.unlock("Carol", CARL, author(CARL))
        assert held(control, run) != ""
        await go_on(control, run, ANN)
        await until(lambda: sent(lab) == 2)
        await control.rights.lock("Carol", CARL, author(CARL), "It leaks oil again.")
        assert await control.stop(run, author(BEN)) == [run]
        assert await ended(control, run) in {"stopped", "halted"}
        assert not await lab.carol.moving(lab.carol.starts[0].graph.name)


@virtual
async def test_after_a_restart_a_held_run_goes_on_by_the_holder_of_its_batons() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control)
    async with lab.runner() as control:
        with pytest.raises(Conflict, match="Ann has its baton"):
            await go_on(control, run, BEN)
        assert sent(lab) == 1
        await go_on(control, run, ANN)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_baton_that_goes_while_a_piece_is_stored_keeps_it_from_leaving() -> None:
    """In the step in which the message would leave, with both choices for lost robots."""
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control)
        began = control.open[run].run.actions["Work_0"]
        assert began.state == "RUNNING"
        lab.harness.journal.slow = 0.4
        await until(lambda: f"{run}.2" in control.open or bool(lab.carol.starts))
        await control.rights.drop("Carol", ANN, author(ANN))
        count = len(lab.carol.starts)
        lab.harness.journal.slow = 0.0
        await anyio.sleep(10)
        assert len(lab.carol.starts) == count
        found = control.open[run].run
        assert (found.desired, found.end) == ("running", None)
        await control.rights.take("Carol", ANN, author(ANN))
        await go_on(control, run, ANN)
        assert await ended(control, run) == "finished"
        assert sent(lab) == 4
        assert msgspec.json.encode(run_view(await control.find(run)))


def confirmed(identity: Identity, age_s: float = 0.0) -> Identity:
    """Return the identity of a person who asks now and was confirmed so long ago."""
    now = clock_us() / 1e6
    return msgspec.structs.replace(identity, confirmed_at=now - age_s, asked_at=now)


@virtual
async def test_a_led_run_needs_a_new_confirmation_when_it_starts_and_goes_on_not_for_each_piece() -> (
    None
):
    lab = Lab({"*": [{"after_s": 400}]})
    async with lab.runner() as control:
        for robot in ("David", "Carol"):
            await control.rights.set_rules(robot, ASKS, OLGA)
        request = led(shared(sequence("task", 4), "Scout", "Carrier"))
        with pytest.raises(Refused, match=r"David: .* confirm that it is you") as refused:
            await control.start(request, author(ANN), confirmed(ANN, 601))
        assert '"item":"confirm"' in msgspec.json.encode(refused.value.where).decode()
        assert sent(lab) == 0
        run = (await control.start(request, author(ANN), confirmed(ANN, 300))).run.id
        await anyio.sleep(1_000)  # what was started goes on, however old the confirmation is
        assert (sent(lab), held(control, run)) == (3, "")
        await control.rights.set_rules("David", Rules(ask_again=1), OLGA)
        assert "at most 1 min old: Ann has given none" in held(control, run)
        with pytest.raises(Forbidden, match="confirm that it is you"):
            await go_on(control, run, confirmed(ANN, 61))
        assert sent(lab) == 3
        await go_on(control, run, confirmed(ANN, 59))
        await anyio.sleep(1_000)
        assert (sent(lab), run in control.open) == (4, False)


@virtual
async def test_a_led_run_that_is_handed_to_an_unconfirmed_person_waits_for_them() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await batons(control, "David", "Carol")
        run = await begin(lab, control)
        with control.rights.here(BEN):
            await control.rights.set_rules("David", Rules(baton=True, ask_again=10), OLGA)
            assert "Ann has given none" in held(control, run)
            await go_on(control, run, confirmed(ANN))
            assert held(control, run) == ""
            await control.hand_over(run, "ben", author(ANN), ANN)
            assert "Ben has given none" in held(control, run)
        assert await control.stop(run, author(CARL)) == [run]
        await ended(control, run)
