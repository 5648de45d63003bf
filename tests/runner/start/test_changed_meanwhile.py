"""A start message is kept back if something changes between the look at its robot and the moment in which it
would leave: another engine, a second one, a queue or a repeat that was closed."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import anyio
import msgspec

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Answer, EngineChanged, Standing
from action_assistant.runner.queues.entry import TurnRequest
from action_assistant.runner.repeats.repeat import NextRequest, RepeatRequest
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from runner.harness import BEN, Harness, clock_us, engine, order, sequence, until, virtual
from runner.queues import test_queues as queues_lab
from runner.registered_robots import NEVER, Open, fleet
from runner.repeats import test_repeats as repeats_lab
from runner.start.test_rights_registry import ANN, author

LONG = {"*": [{"after_s": 500}]}
SLOW_S = 3.0  # for which a start is being stored


@asynccontextmanager
async def being_stored(
    harness: Harness, press: Callable[[], Awaitable[object]]
) -> AsyncIterator[None]:
    """Press a start, and give the time in which it is being stored."""

    async def pressed() -> None:
        try:
            await press()
        except Refused:
            return

    harness.journal.slow = SLOW_S
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(pressed)
        await anyio.sleep(SLOW_S / 3)
        yield
    harness.journal.slow = 0.0
    await anyio.sleep(5)


def only_run(control: ExecutionService) -> Run:
    (opened,) = control.open.values()
    return opened.run


@virtual
async def test_a_start_does_not_leave_to_an_engine_that_nobody_has_looked_at() -> None:
    david, harness, runs = Open(LONG), Harness(), list[Run]()
    async with fleet(harness, David=david) as control:
        control.watch(lambda opened: runs.append(opened.run))
        start = order(sequence(), engine="David")
        async with being_stored(harness, lambda: control.start(start, author(ANN), ANN)):
            david.engine = engine(LONG)  # killed, and started again
        assert david.starts == []
        assert (runs[-1].state, runs[-1].lost) == ("refused", "")
        assert "was restarted since it was looked at" in runs[-1].detail


@virtual
async def test_a_start_does_not_leave_to_two_engines_of_which_its_person_saw_one() -> None:
    david, harness, runs = Open(LONG), Harness(), list[Run]()
    async with fleet(harness, David=david) as control:
        control.watch(lambda opened: runs.append(opened.run))
        start = order(sequence(), engine="David")
        async with being_stored(harness, lambda: control.start(start, author(ANN), ANN)):
            david.servers = 2
        assert david.starts == []
        assert "2 engines are seen" in runs[-1].detail


@virtual
async def test_a_start_in_spite_of_two_engines_leaves_to_them() -> None:
    david, harness = Open(LONG), Harness()
    david.servers = 2
    async with fleet(harness, David=david) as control:
        await anyio.sleep(2)
        knowingly = Override(codes=("proof",), reason="the other one has no robot")
        await control.start(order(sequence(), engine="David", override=knowingly), author(ANN))
        assert len(david.starts) == 1


class Swapped(Open):
    """A robot whose start reaches another process than the one that was looked at."""

    life = ""

    @property
    def standing(self) -> Standing:
        """The standing of the process that answers now."""
        found = super().standing
        return msgspec.structs.replace(found, incarnation=self.life or found.incarnation)

    async def get(self) -> Answer:
        """Return the answer of that process."""
        answer = await super().get()
        return msgspec.structs.replace(answer, incarnation=self.life or answer.incarnation)


@virtual
async def test_a_run_that_another_process_has_is_stopped_again_and_again_and_never_proven() -> None:
    david = Swapped(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), author(ANN))).run.id
        david.life = "another"
        await until(lambda: bool(control.open[run].run.lost))
        assert "Another process of the engine has the run" in control.open[run].run.lost
        david.loss = 1.0
        await control.stop(run, BEN)
        await anyio.sleep(60)
        assert len(david.stops) > 30, "one Stop that is lost is no Stop"
        david.loss = 0.0
        await anyio.sleep(5)
        assert not await david.moving("patrol")
        assert only_run(control).end is None, "nobody knows what the first process does"
        sent = len(david.stops)
        await anyio.sleep(120)
        assert len(david.stops) - sent <= 1, "nothing of it moves there any more"


@virtual
async def test_a_lost_robot_closes_its_queue_and_keeps_the_start_under_way_back() -> None:
    lab = queues_lab.Lab(LONG)
    async with lab.runner() as (_, queues):
        entry = await queues_lab.put(queues, queues_lab.on("David"))
        look = await queues.look(entry.id, {}, ANN)
        press = TurnRequest(look.digest)
        async with being_stored(
            lab.harness, lambda: queues.start(entry.id, press, author(ANN), ANN)
        ):
            lab.david.subscribers.tell(EngineChanged(at=clock_us(), state="gone", why="Away."))
            await until(lambda: queues_lab.why_closed(queues, "David") == "lost")
        assert lab.david.starts == []


@virtual
async def test_a_lost_robot_closes_a_repeat_and_keeps_its_start_under_way_back() -> None:
    lab = repeats_lab.Lab(LONG)
    async with lab.runner() as (_, repeats):
        asked = RepeatRequest(start=order(sequence(), engine="David"), times=3)
        repeat, _ = await repeats.open(asked, author(ANN), ANN)
        async with being_stored(
            lab.harness, lambda: repeats.start(repeat.id, NextRequest(1), author(ANN), ANN)
        ):
            lab.david.subscribers.tell(EngineChanged(at=clock_us(), state="gone", why="Away."))
            await anyio.sleep(0.5)
        assert lab.david.starts == []
        assert (await repeats.find(repeat.id)).closed is not None
