"""The tables say the same as the events, also after they have been made again."""

from pathlib import Path
from typing import Any

from msgspec.structs import replace
from sqlalchemy import select

from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import utc_us
from action_assistant.runner import projection
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs import queries, views
from action_assistant.schema.runner_tables import robot, run
from runner.harness import ANN, BEN, order, sequence, until


async def _all(journal: Journal) -> list[Any]:
    rows = [tuple(row) for row in await journal.query(select(run).order_by(run.c.number))]
    return rows + [tuple(row) for row in await journal.query(select(robot))]


async def test_rebuilt_tables_are_the_same(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=projection.fold)
    async with ExecutionService.opened(journal, Robots(), clock_us=utc_us) as control:
        await control.register(Registration(name="David", profile={"commit": "1"}), ANN)
        await control.register(Registration(name="David", domain=4), ANN)
        fast, endless = {"*": [{"after_s": 0.01}]}, {"*": [{"never": True}]}
        await control.start(order(sequence(), script=fast), ANN)
        stopped = await control.start(order(sequence(), script=endless), ANN)
        await control.stop(stopped.run.id, BEN)
        await until(lambda: not control.open)
    before = await _all(journal)
    assert len(before) == 3
    await journal.rebuild()
    assert await _all(journal) == before
    await journal.close()


async def test_the_row_of_a_run_that_is_over_tells_what_the_run_tells(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=projection.fold)
    async with ExecutionService.opened(journal, Robots(), clock_us=utc_us) as control:
        script = {"*": [{"after_s": 60, "stop_s": 2.5}]}
        started = await control.start(order(sequence(), script=script), ANN)
        await control.stop(started.run.id, BEN)  # takes so long that there is an alarm
        await until(lambda: not control.open)
        told = await control.find(started.run.id)
        query = queries.listed(queries.Filter(), 9)
        (row,) = await control.history.rows(query)
    assert told.alarms
    # The review sums up the duration later.
    assert views.summary_of_row(row) == replace(views.summary(told), took=None)
    await journal.close()
