"""Repeats: cells are started once each, on robots by a person alone, and a reason closes them at once."""

from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict, NotFound, Refused, Unavailable
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.simulator import in_this_process
from action_assistant.runner.repeats.repeat import (
    Axis,
    NextRequest,
    ReopenRequest,
    Repeat,
    RepeatRequest,
    cells_of,
)
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Requested
from action_assistant.umrf.facts import EngineFacts
from runner.execution.test_conductor import Lab as LedLab
from runner.execution.test_conductor import led, shared
from runner.harness import (
    Harness,
    Robot,
    at_once,
    clock_us,
    engine,
    order,
    run_in_virtual_time,
    sequence,
    until,
    virtual,
)
from runner.harness import ended as run_ended
from runner.start.test_rights_registry import ANN, BEN, OLGA, Ended, author
from runner.start.test_start_values import asking
from support.doses import examples

QUICK = {"*": [{"after_s": 1}]}
PLACES = Axis("Work_1", "place", ("valve_7", "valve_8"))
TORQUES = Axis("Work_1", "torque", (1.0, 2.0, 3.0))


class Lab:
    """A runner with repeats, in a place that outlives it."""

    def __init__(self, script: dict[str, Any] | None = None) -> None:
        self.david = Robot(engine(script or QUICK))
        self.harness = Harness({"David": self.david})
        self.ended = Ended()

    @asynccontextmanager
    async def runner(self) -> AsyncIterator[tuple[ExecutionService, Repeats]]:
        async with (
            self.harness.runner(self.ended) as control,
            Repeats.opened(
                control, self.harness.journal, clock_us=clock_us, run_in_worker=at_once
            ) as repeats,
        ):
            yield control, repeats

    def starts(self) -> list[Requested]:
        """The stored starts of all runs, in order."""
        streams = self.harness.journal.streams
        runs = [name.removeprefix("run/") for name in streams if name.startswith("run/")]
        first = [self.harness.journal.told(run)[0] for run in runs]
        return [each for each in first if isinstance(each, Requested)]

    def cells(self) -> list[int]:
        return [each.repeat.cell for each in self.starts() if each.repeat is not None]


def thrice(**changes: Any) -> RepeatRequest:
    """A repeat of three runs in the simulator."""
    start = order(sequence(), request_id="simulated", script=changes.pop("script", QUICK))
    return RepeatRequest(**{"start": start, "times": 3} | changes)


def on_david(**changes: Any) -> RepeatRequest:
    """A repeat of three runs on David."""
    start = order(sequence(), request_id="press", engine="David")
    return RepeatRequest(**{"start": start, "times": 3} | changes)


async def opened(repeats: Repeats, request: RepeatRequest) -> Repeat:
    repeat, fresh = await repeats.open(request, author(ANN), ANN)
    assert fresh
    return repeat


async def pressed(repeats: Repeats, repeat: Repeat, cell: int) -> str:
    started = await repeats.start(repeat.id, NextRequest(cell), author(ANN), ANN)
    return started.run.id


async def over(control: ExecutionService, run: str) -> None:
    await until(lambda: run not in control.open, 3600)


async def closed(repeats: Repeats, repeat: Repeat) -> str:
    """Wait until a repeat is closed, and return why."""
    found = repeats._records[repeat.id]
    await until(lambda: found.repeat.closed is not None, 3600)
    now = (await repeats.find(repeat.id)).closed
    assert now is not None
    return now.why


def test_a_grid_has_a_run_for_each_combination_in_each_round_and_a_seed_shuffles_it() -> None:
    start = order(asking())
    plain = cells_of(RepeatRequest(start=start, times=2, grid=(PLACES, TORQUES)))
    assert len(plain) == 12
    assert plain[0] == {"Work_1": {"place": "valve_7", "torque": 1.0}}
    assert plain[:6] == plain[6:]
    seeded = RepeatRequest(start=start, times=2, grid=(PLACES, TORQUES), seed=4)
    assert cells_of(seeded) == cells_of(seeded) != plain
    for round_ in (cells_of(seeded)[:6], cells_of(seeded)[6:]):
        assert sorted(map(str, round_)) == sorted(map(str, plain[:6]))
    with pytest.raises(BadInput, match="at most 500"):
        cells_of(RepeatRequest(start=start, times=200, grid=(PLACES, TORQUES)))
    with pytest.raises(BadInput, match="has a value already"):
        cells_of(RepeatRequest(start=start, grid=(PLACES, PLACES)))
    large = msgspec.structs.replace(start, values={"Work_1": {"place": "x" * 1_000_000}})
    with pytest.raises(BadInput, match="200,000 bytes at most"):  # before 500 copies are made
        cells_of(RepeatRequest(start=large, times=500))


@virtual
async def test_a_repeat_in_the_simulator_goes_on_by_itself_until_every_cell_was_carried_out() -> (
    None
):
    lab = Lab()
    async with lab.runner() as (_, repeats):
        start = order(asking(), request_id="press", script=QUICK)
        request = RepeatRequest(start=start, grid=(PLACES, TORQUES), by_itself=True)
        repeat = await opened(repeats, request)
        assert await closed(repeats, repeat) == "complete"
        assert lab.cells() == [1, 2, 3, 4, 5, 6]
        assert [each.values for each in lab.starts()] == list(repeat.opened.cells)
        assert {each.digest for each in lab.starts()} == {start.digest}
        again, fresh = await repeats.open(request, author(ANN), ANN)
        assert (again.id, fresh) == (repeat.id, False)
        with pytest.raises(Conflict, match="another repeat"):
            await repeats.open(msgspec.structs.replace(request, seed=1), author(ANN), ANN)
        with pytest.raises(Conflict, match="was started"):
            await repeats.reopen(repeat.id, ReopenRequest(1), author(ANN), ANN)


@virtual
async def test_a_run_that_fails_closes_the_repeat_and_a_person_opens_it_again_for_the_rest() -> (
    None
):
    lab = Lab()
    failing = {"*": [{"result": "on_error"}]}
    async with lab.runner() as (_, repeats):
        repeat = await opened(repeats, thrice(by_itself=True, script=failing))
        assert await closed(repeats, repeat) == "run"
        assert lab.cells() == [1]
        with pytest.raises(Conflict, match="closed again"):
            await repeats.reopen(repeat.id, ReopenRequest(0), author(BEN), BEN)
        again = await repeats.reopen(repeat.id, ReopenRequest(1), author(BEN), BEN)
        assert again.reopened is not None
        assert again.reopened.author == author(BEN)
        assert await closed(repeats, repeat) == "run"
        assert lab.cells() == [1, 2]


class FailingAt:
    """Simulated engines of which one fails: that of the start with this number."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.made = 0

    def __call__(self, facts: EngineFacts, script: str, *more: Any) -> Any:
        """Return the engine for a start."""
        self.made += 1
        if self.made == self.number:
            script = '{"behaviours": {"*": [{"result": "on_error"}]}}'
        return in_this_process(facts, script, *more)


@pytest.mark.long
@virtual
async def test_a_grid_of_sixty_of_which_one_fails_closes_there_and_ends_with_each_cell_once() -> (
    None
):
    lab = Lab()
    places = Axis("Work_1", "place", tuple(f"valve_{n}" for n in range(4)))
    start = order(asking(), request_id="press", script=QUICK)
    request = RepeatRequest(start=start, times=5, grid=(places, TORQUES), seed=7, by_itself=True)
    assert len(cells_of(request)) == 60
    lab.harness.simulator = FailingAt(37)
    async with lab.runner() as (_, repeats):
        repeat = await opened(repeats, request)
        assert await closed(repeats, repeat) == "run"
        assert lab.cells() == list(range(1, 38))
        await anyio.sleep(600)
        assert len(lab.cells()) == 37  # it waits for a person
        await repeats.reopen(repeat.id, ReopenRequest(1), author(BEN), BEN)
        assert await closed(repeats, repeat) == "complete"
        assert lab.cells() == list(range(1, 61))
        assert [each.values for each in lab.starts()] == list(repeat.opened.cells)
        results = [lab.harness.journal.history(each.run).result for each in lab.starts()]
        assert Counter(results) == {"on_true": 59, "on_error": 1}
        assert results[36] == "on_error"


@virtual
async def test_on_a_robot_a_person_starts_each_run_after_the_one_before() -> None:
    lab = Lab()
    async with lab.runner() as (control, repeats):
        with pytest.raises(BadInput, match="a person starts each run"):
            await repeats.open(on_david(by_itself=True), author(ANN), ANN)
        repeat = await opened(repeats, on_david())
        await anyio.sleep(600)
        assert lab.david.starts == []
        run = await pressed(repeats, repeat, 1)
        with pytest.raises(Conflict, match="goes on"):
            await pressed(repeats, repeat, 2)
        assert await pressed(repeats, repeat, 1) == run  # the second press of the same start
        await over(control, run)
        await anyio.sleep(600)
        assert len(lab.david.starts) == 1
        with pytest.raises(Conflict, match="Run 2 of this repeat is the next"):
            await pressed(repeats, repeat, 3)
        async with anyio.create_task_group() as people:
            for _ in range(3):
                people.start_soon(pressed, repeats, repeat, 2)
        assert lab.cells() == [1, 2]
        await until(lambda: not control.open)
        await over(control, await pressed(repeats, repeat, 3))
        assert await closed(repeats, repeat) == "complete"
        assert len(lab.david.starts) == 3


@virtual
async def test_every_kind_of_stop_closes_the_repeats_of_the_robots_concerned() -> None:
    async def stop_all(control: ExecutionService, _run: str) -> None:
        control.stop_all(author(BEN))

    async def stop_robot(control: ExecutionService, _run: str) -> None:
        control.stop_robot("David", author(BEN))

    async def stop_run(control: ExecutionService, run: str) -> None:
        await control.stop(run, author(BEN))

    for stop in (stop_all, stop_robot, stop_run):
        for is_over in (False, True):
            lab = Lab()
            async with lab.runner() as (control, repeats):
                repeat = await opened(repeats, on_david())
                elsewhere = await opened(repeats, thrice(start=order(sequence())))
                run = await pressed(repeats, repeat, 1)
                if is_over:
                    await over(control, run)
                await stop(control, run)
                now = await repeats.find(repeat.id)
                assert now.closed is not None
                assert (now.closed.why, now.closed.by) == ("stop", author(BEN))
                is_open = (await repeats.find(elsewhere.id)).closed is None
                assert is_open == (stop is not stop_all)
                with pytest.raises(Conflict, match="Ben pressed Stop"):
                    await pressed(repeats, repeat, 2)
                await until(lambda: not control.open)
                assert lab.cells() == [1]


@virtual
async def test_a_stop_that_comes_while_a_start_is_being_stored_lets_nothing_leave() -> None:
    for names_run in (False, True):
        lab = Lab()
        async with lab.runner() as (control, repeats):
            repeat = await opened(repeats, on_david())
            run = await pressed(repeats, repeat, 1)
            await over(control, run)
            lab.harness.journal.slow = 1.0
            async with anyio.create_task_group() as people:
                people.start_soon(pressed, repeats, repeat, 2)
                await anyio.sleep(0.5)
                if names_run:
                    await control.stop(run, author(BEN))
                else:
                    control.stop_robot("David", author(BEN))
            lab.harness.journal.slow = 0.0
            await until(lambda: not control.open)
            assert len(lab.david.starts) == 1
            assert await closed(repeats, repeat) == "stop"


@virtual
async def test_a_led_run_is_repeated_and_a_stop_of_its_piece_closes_the_repeat() -> None:
    lab = LedLab(QUICK)
    async with (
        lab.runner() as control,
        Repeats.opened(
            control, lab.harness.journal, clock_us=clock_us, run_in_worker=at_once
        ) as repeats,
    ):
        start = led(shared(sequence("task", 2), "Scout", "Carrier"))
        repeat = await opened(repeats, RepeatRequest(start=start, times=2))
        assert len(repeat.opened.robots) == 2
        run = await pressed(repeats, repeat, 1)
        await until(lambda: f"{run}.1" in control.open)
        await control.stop(f"{run}.1", author(BEN))
        assert await closed(repeats, repeat) == "stop"
        await until(lambda: not control.open)
        await repeats.reopen(repeat.id, ReopenRequest(1), author(ANN), ANN)
        await over(control, await pressed(repeats, repeat, 2))
        assert await closed(repeats, repeat) == "complete"


@virtual
async def test_a_lost_robot_a_changed_baton_and_a_word_of_rest_close_repeats() -> None:
    lab = Lab({"*": [{"never": True}]})
    async with lab.runner() as (control, repeats):
        await control.rights.set_rules("David", Rules(baton=True), OLGA)
        await control.rights.take("David", ANN, author(ANN))
        repeat = await opened(repeats, on_david())
        await control.rights.take("David", BEN, author(BEN), "my turn")
        assert await closed(repeats, repeat) == "baton"
        with pytest.raises(Conflict, match="baton"):
            await repeats.reopen(repeat.id, ReopenRequest(1), author(ANN), ANN)
        again = await repeats.reopen(repeat.id, ReopenRequest(1), author(BEN), BEN)
        assert again.closed is None
        started = await repeats.start(repeat.id, NextRequest(1), author(BEN), BEN)
        await until(lambda: control.open[started.run.id].run.state == "running")
        lab.david.engine = engine(QUICK)  # started anew
        why = await closed(repeats, repeat)
        assert why == "lost"
        closings = (await repeats.find(repeat.id)).closings
        with pytest.raises(Refused):  # nobody has looked
            await repeats.reopen(repeat.id, ReopenRequest(closings), author(BEN), BEN)
        await until(lambda: bool(control.open[started.run.id].run.lost))
        await control.confirm_rest(started.run.id, RestRequest(how="It stands still."), author(BEN))
        await until(lambda: not control.open)
        again = await repeats.reopen(repeat.id, ReopenRequest(closings), author(BEN), BEN)
        assert again.closed is None
        started = await repeats.start(repeat.id, NextRequest(2), author(BEN), BEN)
        await over(control, started.run.id)
        assert (await repeats.find(repeat.id)).closed is None


@virtual
async def test_nothing_goes_on_after_a_restart_until_a_person_has_looked() -> None:
    lab = Lab()
    async with lab.runner() as (_, repeats):
        simulated = await opened(repeats, thrice(by_itself=True))
        repeat = await opened(repeats, on_david())
        await until(lambda: lab.cells() == [1])
    async with lab.runner() as (_, repeats):
        await anyio.sleep(600)
        assert set(lab.cells()) == {1}  # of the simulated one
        for each in (simulated, repeat):
            now = await repeats.find(each.id)
            assert now.closed is not None
            assert now.closed.why == "restart"
            with pytest.raises(Conflict, match="started again"):
                await pressed(repeats, each, 1)
        assert {each.id for each in await repeats.newest()} == {simulated.id, repeat.id}
        again = await repeats.reopen(simulated.id, ReopenRequest(1), author(ANN), ANN)
        assert again.closed is None
        assert await closed(repeats, simulated) == "complete"
        assert lab.cells() == [1, 2, 3]
        with pytest.raises(NotFound):
            await repeats.find("nothing")


@virtual
async def test_a_repeat_goes_on_by_itself_no_longer_than_its_person_is_signed_in() -> None:
    lab = Lab()
    async with lab.runner() as (_, repeats):
        repeat = await opened(repeats, thrice(by_itself=True))
        await until(lambda: lab.cells() == [1])
        lab.ended.sessions.add(ANN.session.id if ANN.session else "")
        assert await closed(repeats, repeat) == "refused"
        assert lab.cells() == [1]


@virtual
async def test_a_refused_start_uses_up_no_cell_and_a_value_that_cannot_be_is_named() -> None:
    lab = Lab()
    async with lab.runner() as (control, repeats):
        start = order(asking(), request_id="press", engine="David")
        wrong = Axis("Work_1", "torque", (1.0, 61.0))
        with pytest.raises(BadInput) as refused:
            await repeats.open(RepeatRequest(start=start, grid=(PLACES, wrong)), author(ANN), ANN)
        assert refused.value.where == {"path": "/grid/1", "cell": 2}
        lab.harness.journal.down = True
        with pytest.raises(Unavailable):
            await repeats.open(on_david(), author(ANN), ANN)
        lab.harness.journal.down = False
        repeat = await opened(repeats, on_david())
        lab.harness.journal.down = True
        with pytest.raises(Refused):
            await pressed(repeats, repeat, 1)
        lab.harness.journal.down = False
        await over(control, await pressed(repeats, repeat, 1))
        assert len(lab.david.starts) == 1


@virtual
async def test_runs_that_change_while_the_runner_shuts_down_find_no_repeats_to_close() -> None:
    lab = Lab()
    async with lab.harness.runner(lab.ended) as control:
        async with Repeats.opened(
            control, lab.harness.journal, clock_us=clock_us, run_in_worker=at_once
        ) as repeats:
            repeat = await opened(repeats, on_david(times=1))
            run = await pressed(repeats, repeat, 1)
        assert await run_ended(control, run) == "finished"
        found = (await repeats.find(repeat.id)).closed
        assert found is not None
        assert found.why == "restart"


STEPS = st.lists(
    st.tuples(
        st.sampled_from(
            [
                *["press"] * 8,
                *("wait", "wait", "reopen", "reopen", "stop_all", "stop_robot", "stop_run"),
                *("close", "restart", "wait", "wait", "lost", "baton", "down", "slow"),
            ]
        ),
        st.sampled_from([0, 0, 1, 2, 3]),
    ),
    min_size=3,
    max_size=14,
)


class History:
    """A random history of a repeat on David and one that goes on by itself in the simulator."""

    def __init__(self, lab: Lab) -> None:
        self.lab = lab
        self.presses = 0

    async def live(self, steps: list[tuple[str, int]]) -> None:
        left = list(steps)
        while left:
            async with self.lab.runner() as (control, repeats), anyio.create_task_group() as people:
                await self._openings(repeats)
                while left:
                    what, number = left.pop(0)
                    if what == "restart":
                        break
                    await self._step(what, number, control, repeats, people)
                    self.check()
                journal = self.lab.harness.journal
                if journal.slow:  # virtual time stands still where a shielded wait is cancelled
                    journal.slow = 0.0
                    await anyio.sleep(3)
                journal.down = False
                people.cancel_scope.cancel()
        async with self.lab.runner():
            before = len(self.lab.david.starts)
            await anyio.sleep(20)
            assert len(self.lab.david.starts) == before, "a restart started something"
            self.check()

    async def _openings(self, repeats: Repeats) -> None:
        await repeats.open(on_david(), author(ANN), ANN)
        simulated = order(sequence(), request_id="sim", script=QUICK)
        await repeats.open(thrice(start=simulated, by_itself=True), author(ANN), ANN)

    async def _press(self, repeats: Repeats, repeat: Repeat, cell: int) -> None:
        with suppress(Refused):
            known = repeats._records.get(repeat.id)
            await pressed(repeats, repeat, cell or (known and known.next_cell) or 1)

    async def _step(
        self, what: str, number: int, control: ExecutionService, repeats: Repeats, people: Any
    ) -> None:
        journal, (repeat, _) = self.lab.harness.journal, await self._both(repeats)
        runs = list(control.open)
        match what:
            case "press":
                self.presses += 1
                people.start_soon(self._press, repeats, repeat, number)
                await anyio.sleep(number / 10)
            case "reopen":
                closings = (await repeats.find(repeat.id)).closings
                with suppress(Refused):
                    await repeats.reopen(repeat.id, ReopenRequest(closings), author(ANN), ANN)
            case "stop_all" | "stop_robot":
                if what == "stop_all":
                    control.stop_all(author(BEN))
                else:
                    control.stop_robot("David", author(BEN))
                await self._quiet(repeats, repeat)
            case "stop_run" if runs:
                await control.stop(runs[number % len(runs)], author(BEN))
            case "close":
                await repeats.close(repeat.id, author(BEN))
            case "wait":
                await anyio.sleep(3 * number)
            case "lost":
                self.lab.david.engine = engine(QUICK)
            case "baton":
                with suppress(Unavailable):
                    await control.rights.set_rules("David", Rules(baton=number > 0), OLGA)
                    if number > 0:
                        await control.rights.take("David", ANN, author(ANN), "mine")
            case "down":
                journal.down = number > 1
            case "slow":
                journal.slow = number / 2
            case _:
                pass

    async def _both(self, repeats: Repeats) -> tuple[Repeat, Repeat]:
        found = {each.opened.engine: each for each in await repeats.newest()}
        return found["David"], found["simulator"]

    async def _quiet(self, repeats: Repeats, repeat: Repeat) -> None:
        """After a Stop nothing of the repeat leaves, whatever was under way."""
        assert (await repeats.find(repeat.id)).closed is not None
        before = len(self.lab.david.starts)
        await anyio.sleep(2)
        assert len(self.lab.david.starts) == before, "a start left after a Stop"

    def check(self) -> None:
        sent = [(each.run) for each in self.lab.david.starts]
        assert len(sent) == len(set(sent)) <= self.presses, "a start without a press"
        cells = [
            (each.repeat.id, each.repeat.cell)
            for each in self.lab.starts()
            if each.repeat is not None
        ]
        assert len(cells) == len(set(cells)), "a cell was started twice"


@settings(
    max_examples=examples(40),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(STEPS)
def test_no_history_starts_a_cell_twice_or_a_robot_without_a_press_or_after_a_stop(
    steps: list[tuple[str, int]],
) -> None:
    run_in_virtual_time(lambda: History(Lab()).live(steps))
