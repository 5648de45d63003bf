"""The metrics of runs count what people see as runs."""

import random
from typing import Any

import anyio

from action_assistant.runner.api.monitoring import RunMetrics
from action_assistant.runner.links.port import Registration
from runner.harness import ANN, Harness, Robot, ended, engine, order, sequence, until, virtual


@virtual
async def test_the_pieces_of_a_led_run_are_not_counted_as_runs() -> None:
    david = Robot(engine({"*": [{"after_s": 2}]}), random.Random(1))
    async with Harness({"David": david}).runner() as control, anyio.create_task_group() as engines:
        engines.start_soon(david.engine.run)
        control.robots.add(Registration(name="David", led=True))
        metrics = RunMetrics(control)

        def told(name: str) -> Any:
            return next(each.values for each in metrics.families() if each.name == name)

        await anyio.sleep(1)
        asked = order(sequence(actions=2), engine="conducted", robots={"": "David"})
        run = (await control.start(asked, ANN)).run.id
        await until(lambda: len(control.open) == 2)
        assert told("runs_open") == 1
        assert list(told("runs").values()) == [1]
        assert await ended(control, run) == "finished"
        await until(lambda: not control.open)
        assert dict(told("runs_ended")) == {("conducted", "finished"): 1}
        engines.cancel_scope.cancel()
