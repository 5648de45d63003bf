"""Several robots start one version together, or none of them does."""

from typing import Any

import anyio
import pytest

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.links.port import Leaves, Order, unwatched
from action_assistant.runner.runs import queries
from action_assistant.runner.start.idempotency import STOPPED_WITH
from runner.harness import ANN, BEN, Harness, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet, group


@virtual
async def test_a_group_starts_together_and_is_stopped_together() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    harness = Harness()
    async with fleet(harness, David=david, Eve=eve) as control:
        started = await control.start_group(group(sequence(), "Eve", "David"), ANN)
        assert [run.engine for run in started.runs] == ["David", "Eve"]
        assert {run.group for run in started.runs} == {started.group}
        again = await control.start_group(group(sequence(), "Eve", "David"), ANN)
        assert (again.group, again.fresh) == (started.group, False)
        assert (len(david.starts), len(eve.starts)) == (1, 1)
        stopped = await control.stop(started.group, BEN)
        assert sorted(stopped) == sorted(run.id for run in started.runs)
        await until(lambda: not control.open)
    for run in started.runs:
        told = harness.journal.history(run.id)
        assert (told.state, told.group) == ("stopped", started.group)


@virtual
async def test_a_start_that_is_under_way_says_so_until_its_runs_are_there() -> None:
    harness = Harness()
    async with fleet(harness, David=Open(NEVER), Eve=Open(NEVER)) as control:
        asked = group(sequence(), "David", "Eve")
        harness.journal.slow = 1.0

        async def found() -> list[str]:
            rows = await control.history.rows(queries.of_start(asked.request_id))
            return sorted([(await control.find(row.id)).engine for row in rows])

        async with anyio.create_task_group() as tasks:
            assert not control.under_way(asked.request_id)
            tasks.start_soon(control.start_group, asked, ANN)
            await anyio.sleep(0.5)
            assert (control.under_way(asked.request_id), await found()) == (True, [])
        assert (control.under_way(asked.request_id), await found()) == (False, ["David", "Eve"])
        control.stop_all(BEN)
        await until(lambda: not control.open)


@pytest.mark.parametrize("other", ["simulator", "conducted"])
@virtual
async def test_a_group_has_robots_only(other: str) -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        with pytest.raises(BadInput, match="robots only") as refused:
            await control.start_group(group(sequence(), "David", other), ANN)
    assert refused.value.where == {"path": "/engines"}
    assert david.starts == []


@pytest.mark.parametrize(
    "field",
    [
        {"robots": {"Scout": "David"}},
        {"people": {"guard": ""}},
        {"levels": "opened"},
        {"like": "Eve"},
        {"behaviours": True},
    ],
    ids="".join,
)
@virtual
async def test_a_group_takes_nothing_of_a_led_run_and_nothing_of_the_simulator(
    field: dict[str, Any],
) -> None:
    david, eve = Open(NEVER), Open(NEVER)
    async with fleet(Harness(), David=david, Eve=eve) as control:
        with pytest.raises(BadInput, match="Only") as refused:
            await control.start_group(group(sequence(), "David", "Eve", **field), ANN)
    assert refused.value.where == {"path": f"/{''.join(field)}"}
    assert (david.starts, eve.starts) == ([], [])


@virtual
async def test_no_start_of_a_group_when_one_robot_is_not_fit() -> None:
    david, eve = Open(), Open()
    async with fleet(Harness(), David=david, Eve=eve) as control:
        eve.silent = True
        with pytest.raises(Conflict, match="Eve does not answer"):
            await control.start_group(group(sequence(), "David", "Eve"), ANN)
    assert (david.starts, eve.starts) == ([], [])


@virtual
async def test_a_group_that_starts_in_part_says_which_robot_was_left_out() -> None:
    harness, eve = Harness(), Open(NEVER)

    class Breaks(Open):
        async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
            """The disk is full right after it."""
            harness.journal.down = True
            await super().start(order, leaves)

    david = Breaks(NEVER)
    async with fleet(harness, David=david, Eve=eve) as control:
        started = await control.start_group(group(sequence(), "David", "Eve"), ANN)
        assert [run.engine for run in started.runs] == ["David"]
        assert "could not be recorded" in started.failed["Eve"]
        assert eve.starts == []
        harness.journal.down = False
        control.stop_all(ANN)
        await until(lambda: not control.open)


@pytest.mark.parametrize("press", ["its run", "its robot"])
@virtual
async def test_after_a_stop_of_one_run_the_others_of_its_start_begin_no_more(press: str) -> None:
    harness, david, eve = Harness(), Open(NEVER), Open(NEVER)
    async with fleet(harness, David=david, Eve=eve) as control:
        asked = group(sequence(), "David", "Eve")
        harness.journal.slow = 0.5
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.start_group, asked, ANN)
            await until(lambda: bool(david.starts))
            (run,) = control.open
            if press == "its run":
                assert await control.stop(run, BEN) == [run]
            else:
                control.stop_robot("David", BEN)
        assert eve.starts == []
        await until(lambda: not control.open)
        other = await control.find((await control.start_group(asked, ANN)).runs[1].id)
        assert (other.engine, other.state) == ("Eve", "refused")
        assert other.detail == STOPPED_WITH
