"""A led run keeps all of its robots from its request to its proven end, whoever asks, and when."""

import anyio
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from runner.execution.test_conductor import Lab, led, refused, shared
from runner.harness import ANN, BEN, ended, order, sequence, until, virtual


async def kept(control: ExecutionService) -> None:
    """Try everything that would take a robot from run 1."""
    for name in ("David", "Carol"):
        start = order(sequence("other"), engine=name)
        assert f"{name} is taken by run 1" in await refused(control, start)
        for asked in (
            Registration(name=name),
            Registration(name=name, led=True, profile={"hazards": ["H4"]}),
        ):
            with pytest.raises(Conflict, match=f"Run 1 goes on {name}"):
                await control.register(asked, ANN)
        with pytest.raises(Conflict, match=f"Run 1 goes on {name}"):
            await control.remove(name, ANN)
    assert "run 1" in await refused(control, led(shared(sequence("o", 2), "Scout", "Carrier")))


@virtual
async def test_a_led_run_keeps_its_robots_while_it_waits_is_held_and_after_a_restart() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    request = led(shared(sequence("task", 3), "Scout", "Carrier"), lost="wait")
    async with lab.runner() as control:
        run = (await control.start(request, ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        await kept(control)  # Carol has no piece yet
        again = await control.start(request, ANN)
        assert (again.run.id, again.fresh) == (run, False)
    async with lab.runner() as control:
        await anyio.sleep(30)  # nothing of it moves any more, and it is held
        assert control.open[run].run.held is not None
        assert not await lab.david.moving("task--Work_0")
        await kept(control)
        again = await control.start(request, ANN)
        assert (again.run.id, again.fresh) == (run, False)
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        again = await control.start(request, ANN)
        assert (again.run.id, again.fresh) == (run, False)
        await control.register(Registration(name="Carol"), ANN)
        assert "Led runs are off for Carol" in await refused(
            control, led(shared(sequence("other", 2), "Scout", "Carrier"))
        )
    assert len(lab.david.starts) == 1
    assert lab.carol.starts == []
