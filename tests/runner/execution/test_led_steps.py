"""*Wait* and *Step* of a led run: nothing further begins until a person wants it, and a step lets exactly
one action begin."""

import anyio
import pytest

from action_assistant.errors import BadInput, Conflict, OutcomeUnknown, Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Author, Released
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import run_view, time
from action_assistant.runner.start.admission import GoOnRequest, StepRequest, WaitRequest
from runner.execution.test_conductor import Lab, forked, led, shared
from runner.harness import ANN, BEN, ended, order, sequence, two_lines, until, virtual


async def waiting(lab: Lab, control: ExecutionService, *, actions: int = 4) -> str:
    """Start a run that a person makes wait while its first action moves; return its id."""
    run = await lab.led_run(control, actions=actions, lost="wait")
    await control.wait(run, WaitRequest("The pallet is crooked."), BEN)
    return run


def now(control: ExecutionService, run: str) -> Run:
    return control.open[run].run


async def ready(control: ExecutionService, run: str, *nodes: str) -> None:
    """Wait until exactly these actions wait to begin."""
    await until(lambda: {node for node, _ in now(control, run).waits.values()} == set(nodes))


def step(control: ExecutionService, run: str, **goal: str) -> StepRequest:
    held = now(control, run).held
    assert held is not None
    return StepRequest(time(held.at), **goal)


@virtual
async def test_a_run_that_waits_goes_on_moving_and_begins_nothing_until_go_on() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
        shown = run_view(now(control, run))
        assert shown.held is not None
        assert shown.held.why == "Ben made it wait: The pallet is crooked."
        assert shown.held.by == BEN
        assert shown.held.how == "wait"
        assert [each.state for each in shown.rests or () if each.robot == "David"] == ["going"]
        await ready(control, run, "Work_1")
        shown = run_view(now(control, run))
        assert [each.state for each in shown.rests or () if each.robot == "David"] == ["proven"]
        assert shown.held is not None
        assert [(each.action, each.robot) for each in shown.held.next] == [("Work_1", "Carol")]
        await anyio.sleep(60)
        assert lab.carol.starts == []
        await control.go_on(run, GoOnRequest(shown.held.since), ANN)
        assert await ended(control, run) == "finished"


@virtual
async def test_each_step_lets_one_action_begin_and_then_waits_again() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
        for number in (1, 2, 3):
            await ready(control, run, f"Work_{number}")
            await control.step(run, step(control, run), ANN)
            node = f"Work_{number}"
            await until(lambda node=node: now(control, run).actions[node].state == "RUNNING")
            held = now(control, run).held
            assert held is not None
            assert (held.how, held.by, held.node) == ("step", ANN, node)
            await anyio.sleep(3)
            assert len(lab.david.starts) + len(lab.carol.starts) == number + 1
        assert await ended(control, run) == "finished"


@virtual
async def test_a_step_is_refused_while_nothing_waits_to_begin() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
        with pytest.raises(Conflict, match="No action waits to begin now"):
            await control.step(run, step(control, run), ANN)
        await ready(control, run, "Work_1")
        with pytest.raises(Conflict, match="Only Work_1 on Carol waits to begin"):
            await control.step(run, step(control, run, action="Work_2"), ANN)
        with pytest.raises(Conflict, match="Work_1 waits to begin already"):
            await control.step(run, step(control, run, until="Work_1"), ANN)
        with pytest.raises(BadInput, match="Nothing_9 is no action of this run"):
            await control.step(run, step(control, run, until="Nothing_9"), ANN)
        assert lab.carol.starts == []
        await control.stop(run, BEN)
        await ended(control, run)


@virtual
async def test_of_two_steps_at_once_one_counts_and_the_other_person_is_told() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    lab.david.old = lab.carol.old = 0.3  # a look takes so long
    async with lab.runner() as control:
        run = await waiting(lab, control)
        await ready(control, run, "Work_1")
        asked, refused = step(control, run), list[str]()

        async def press(author: Author) -> None:
            try:
                await control.step(run, asked, author)
            except Refused as why:
                refused.append(why.detail)

        async with anyio.create_task_group() as presses:
            presses.start_soon(press, ANN)
            presses.start_soon(press, BEN)
        (why,) = refused
        assert why.startswith("The run has gone on, was stopped, or has another reason to wait")
        await anyio.sleep(30)
        assert len(lab.carol.starts) == 1
        assert len(lab.david.starts) == 1
        await control.stop(run, BEN)
        await ended(control, run)
    told = lab.harness.journal.told(run)
    assert [each.step for each in told if isinstance(each, Released)] == ["Work_1"]


@virtual
async def test_of_two_actions_that_wait_the_named_one_begins() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    lab.carol.old = 0.5  # the look at the other robot is quicker
    async with lab.runner() as control:
        started = await control.start(led(shared(two_lines(), "Scout", "Carrier")), ANN)
        run = started.run.id
        await control.wait(run, WaitRequest(), BEN)
        await until(lambda: len(now(control, run).waits) == 2)
        (_, (first, _)), (_, (second, _)) = sorted(now(control, run).waits.items())
        await control.step(run, step(control, run, action=second), ANN)
        await until(lambda: now(control, run).held is not None)
        await anyio.sleep(2)
        began = [each for link in (lab.david, lab.carol) for each in link.starts]
        assert [tuple(each.graph.actions) for each in began] == [(second,)]
        assert now(control, run).actions[second].state == "RUNNING"
        assert now(control, run).actions[first].state == "UNINITIALIZED"
        await control.stop(run, BEN)
        await ended(control, run)


@virtual
async def test_a_step_until_an_action_waits_before_it() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
        await ready(control, run, "Work_1")
        await control.step(run, step(control, run, until="Work_3"), ANN)
        await ready(control, run, "Work_3")
        held = now(control, run).held
        assert held is not None
        assert (held.how, held.node) == ("step", "Work_3")
        await anyio.sleep(30)
        assert len(lab.david.starts) == 2
        assert len(lab.carol.starts) == 1
        await control.go_on(run, GoOnRequest(time(held.at)), ANN)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_fault_while_a_run_waits_is_seen_before_it_goes_on() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
        seen = step(control, run).since
        lab.david.silent = True
        await until(
            lambda: now(control, run).held is not None and now(control, run).held.by is None
        )
        lab.david.silent = False
        await anyio.sleep(60)
        for refused in (
            control.go_on(run, GoOnRequest(seen), BEN),
            control.step(run, StepRequest(seen), BEN),
        ):
            with pytest.raises(Conflict, match="does not answer"):
                await refused
        assert lab.carol.starts == []
        await control.stop(run, BEN)
        await ended(control, run)


@virtual
async def test_a_wait_and_its_reason_survive_a_kill_of_the_runner() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await waiting(lab, control)
    for _ in range(2):
        async with lab.runner() as control:
            await anyio.sleep(20)
            held = now(control, run).held
            assert held is not None
            assert held.why == (
                "The runner was restarted while it led this run. Before that it was held: Ben made it "
                "wait: The pallet is crooked."
            )
            assert lab.carol.starts == []
    async with lab.runner() as control:
        await ready(control, run, "Work_1")
        await control.step(run, step(control, run), ANN)
        await until(lambda: bool(lab.carol.starts))
        await ready(control, run, "Work_2")
        held = now(control, run).held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), ANN)
        assert await ended(control, run) == "finished"
    assert len(lab.david.starts) == len(lab.carol.starts) == 2


@virtual
async def test_a_wait_that_cannot_be_stored_holds_the_run_and_says_so() -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.harness.journal.down = True
        with pytest.raises(OutcomeUnknown, match="The run waits, but that could not be stored yet"):
            await control.wait(run, WaitRequest(request_id="press 1"), BEN)
        lab.harness.journal.down = False
        assert (await control.wait(run, WaitRequest(request_id="press 1"), BEN)).held is not None
        await ready(control, run, "Work_1")
        await control.go_on(run, GoOnRequest(step(control, run).since), BEN)
        assert (await control.wait(run, WaitRequest(request_id="press 1"), BEN)).held is None
        assert await ended(control, run) == "finished"


@virtual
async def test_stop_ends_a_run_that_waits_and_no_step_counts_after_it() -> None:
    lab = Lab({"*": [{"after_s": 30, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await forked(lab, control)
        await until(lambda: bool(lab.david.starts and lab.carol.starts))
        await control.wait(run, WaitRequest(), BEN)
        asked = step(control, run)
        await control.stop(run, ANN)
        for refused in (control.step(run, asked, BEN), control.wait(run, WaitRequest(), BEN)):
            with pytest.raises(Conflict):
                await refused
        assert await ended(control, run) == "stopped"


@virtual
async def test_a_run_that_was_handed_over_whole_cannot_wait() -> None:
    lab = Lab({"*": [{"after_s": 30}]})
    async with lab.runner() as control:
        run = (await control.start(order(sequence("task", 2), engine="David"), ANN)).run.id
        with pytest.raises(Conflict, match="Its engine has the whole graph"):
            await control.wait(run, WaitRequest(), BEN)
        await control.stop(run, BEN)
        await ended(control, run)
