"""Records the streams of runs of every kind as this version writes them: `tests/data/streams`.

`PYTHONPATH=tests .venv/bin/python -m runner.record_streams FOLDER` writes a new folder, with what this
version makes of each stream beside it. Recorded folders never change: they are what people have on
their disks.
"""

import asyncio
import random
import secrets
import sys
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import anyio
import msgspec

from action_assistant.journal.events import Event
from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, Start, index_of
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import decode
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import GroupRequest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Parameter
from action_assistant.umrf.semantics import script_from
from runner import harness
from runner.fake_link import FakeLink
from runner.fake_network import FakeNetwork, now_ms
from runner.harness import (
    ANN,
    BEN,
    Harness,
    carousel,
    order,
    run_in_virtual_time,
    sequence,
)
from runner.robots_in_network import all_over, confirm_lost


class Line(msgspec.Struct, frozen=True):
    """One stored event of a file."""

    kind: str
    author: str
    at: int
    body: msgspec.Raw


class Place:
    """Two robots with their runner."""

    def __init__(self, script: dict[str, Any]) -> None:
        self.network = FakeNetwork()
        links = {name: FakeLink(self.network, name, f"/{name}") for name in ("Robin", "Marian")}
        self.harness = Harness(dict(links))
        self.script = script_from({"behaviours": script})
        self.control: ExecutionService

    def robot(self, name: str) -> None:
        """Add a robot whose engine comes up."""
        engine = EmulatedEngine(
            name,
            script=self.script,
            index=index_of([], []),
            quirks=EngineTraits(loss=0.2),
            born_ms=now_ms(),
            epoch_ms=harness.EPOCH // 1000,
        )
        self.network.join(engine, f"/{name}")

    async def start(self, graph: Graph, engine: str = "Robin", **more: Any) -> str:
        """Let Ann start the graph."""
        asked = order(graph, engine=engine, graph=None, request_id=graph.name, **more)
        return (await self.control.start(asked, ANN)).run.id


Story = Callable[[Place], Awaitable[None]]


async def finished(place: Place) -> None:
    """Two actions, of which the first has a parameter."""
    plan = sequence("finished", 2)
    leaf = '{"pvf_type":"number","pvf_value":0.5}'
    first = msgspec.structs.replace(plan.actions[0], inputs=(Parameter("arm/speed", leaf),))
    await place.start(msgspec.structs.replace(plan, actions=(first, *plan.actions[1:])))
    await all_over(place.control)


async def laps(place: Place) -> None:
    """A loop of a dozen laps, stopped."""
    run = await place.start(carousel("laps"))
    await anyio.sleep(60)
    await place.control.stop(run, BEN)
    await all_over(place.control)


async def stopped(place: Place) -> None:
    """A person who did not start it stops the run."""
    run = await place.start(sequence("stopped", 3))
    await anyio.sleep(6)
    await place.control.stop(run, BEN)
    await all_over(place.control)


async def failed(place: Place) -> None:
    """The second action ends in error."""
    await place.start(sequence("failed", 3))
    await all_over(place.control)


async def engine_lost(place: Place) -> None:
    """The engine dies, and another one comes up."""
    await place.start(sequence("engine_lost", 2))
    await anyio.sleep(4)
    place.network.kill(place.network.nodes[0])
    await anyio.sleep(16)
    place.robot("Robin")
    await confirm_lost(place.control)
    await all_over(place.control)


async def foreign(place: Place) -> None:
    """Another person starts a graph of the same name."""
    plan = sequence("foreign", 2)
    await place.start(plan)
    await anyio.sleep(4)
    place.network.strangers = 1
    text = codec.write(plan)
    place.network.carry(
        Start(graph_name="foreign", targets=("Robin",), graph_json=text), "terminal"
    )
    await confirm_lost(place.control)
    await all_over(place.control)


async def paused(place: Place) -> None:
    """Paused and resumed, in the simulator."""
    script = {"*": [{"after_s": 4}]}
    run = await place.start(sequence("paused", 2), "simulator", script=script)
    await anyio.sleep(2)
    await place.control.pause(run, BEN)
    await anyio.sleep(9)
    await place.control.resume(run, ANN)
    await all_over(place.control)


async def simulated(place: Place) -> None:
    """Run in the simulator, with a message and a result of each kind."""
    script = {
        "Work_0": [{"after_s": 1, "result": "on_false", "message": "no way through"}],
        "Work_1": [{"after_s": 1, "result": "on_error", "message": "gripper jammed"}],
    }
    await place.start(sequence("simulated", 3), "simulator", script=script)
    await all_over(place.control)


async def together(place: Place) -> None:
    """Two robots start together."""
    one = order(sequence("together", 2), graph=None, request_id="together")
    fields = {name: getattr(one, name) for name in ("version", "digest", "umrf", "request_id")}
    await place.control.start_group(GroupRequest(engines=("Marian", "Robin"), **fields), ANN)
    await all_over(place.control)


async def runner_restarted(place: Place) -> None:
    """The runner ends while a run goes; `told` begins another one."""
    await place.start(sequence("runner_restarted", 3))
    await anyio.sleep(6)


STORIES: dict[Story, dict[str, Any]] = {
    finished: {"*": [{"after_s": 3, "message": "done"}]},
    laps: {"*": [{"after_s": 2, "message": "lap"}]},
    stopped: {"*": [{"after_s": 20, "stop_s": 0.3}]},
    failed: {"Work_1": [{"after_s": 2, "result": "on_error"}], "*": [{"after_s": 2}]},
    engine_lost: {"*": [{"after_s": 60}]},
    foreign: {"*": [{"after_s": 40, "stop_s": 0.3}]},
    paused: {},
    simulated: {},
    together: {"*": [{"after_s": 3}]},
    runner_restarted: {"*": [{"after_s": 5}]},
}


async def told(story: Story) -> list[list[Event]]:
    """The streams of a story."""
    place = Place(STORIES[story])
    async with place.network.running():
        place.robot("Robin")
        place.robot("Marian")
        await anyio.sleep(0.5)
        async with place.harness.runner() as place.control:
            await anyio.sleep(1.5)
            await story(place)
        if story is runner_restarted:
            await anyio.sleep(3)
            async with place.harness.runner() as place.control:
                await all_over(place.control)
    streams = place.harness.journal.streams
    return [streams[name] for name in sorted(streams) if name.startswith("run/")]


def expected(events: list[Event]) -> Any:
    """Return the fold of a stream as plain values."""
    run = replay(decode(each.kind, each.body) for each in events)
    assert run is not None
    return as_told(run)


def as_told(run: Run) -> Any:
    """A run as people and programs see it, and the lines of its engine."""
    return msgspec.to_builtins(views.run_view(run))


def recorded() -> Iterator[tuple[str, list[Event]]]:
    """Return all streams by name."""
    for story in STORIES:
        with _same_every_time(story.__name__):
            streams = run_in_virtual_time(lambda s=story: told(s))
        for number, events in enumerate(streams, 1):
            yield f"{story.__name__}{number if len(streams) > 1 else ''}", events


@contextmanager
def _same_every_time(name: str) -> Iterator[None]:
    """Ids are drawn by chance; here they are counted."""
    random.seed(7)
    counted = iter(range(1, 100))
    with patch.object(secrets, "token_urlsafe", lambda _=None: f"{name}-{next(counted)}"):
        yield


def main() -> None:
    """Write the files of all streams."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True)
    for name, events in recorded():
        lines = [Line(each.kind, each.author, each.at, msgspec.Raw(each.body)) for each in events]
        text = b"".join(msgspec.json.encode(line) + b"\n" for line in lines)
        (folder / f"{name}.jsonl").write_bytes(text)
        found = msgspec.json.format(msgspec.json.encode(expected(events)))
        (folder / f"{name}.expected.json").write_bytes(found + b"\n")


if __name__ == "__main__":
    asyncio.set_event_loop_policy(None)
    main()
