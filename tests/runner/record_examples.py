"""Records the examples of failed runs: the real runner and stand-in engines, in virtual time.

`PYTHONPATH=tests .venv/bin/python -m runner.record_examples` writes them again, the same every time.
"""

import asyncio
import itertools
import sys
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import anyio
import msgspec

from action_assistant.paths import examples
from action_assistant.runner.archives import examples as recorded_runs
from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, Start, index_of
from action_assistant.runner.execution import start_checks
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Author, Override
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
)
from action_assistant.umrf.semantics import script_from
from runner import harness
from runner.fake_link import FakeLink
from runner.fake_network import FakeNetwork, Node, now_ms
from runner.harness import Harness, order, run_in_virtual_time
from runner.robots_in_network import all_over, confirm_lost

ROBOT = "Robin"
ADA, BEN = Author("example-ada", "Ada"), Author("example-ben", "Ben")
MORNING = 1_795_165_200_000_000  # 20 November 2026, 9:00 UTC
_ON = Conditions(on_true="run", on_false="ignore", on_error="ignore")


def graph(name: str, *arrows: tuple[str, str], inputs: dict[str, Parameter] | None = None) -> Graph:
    """A graph of arrows between names, laid out from left to right."""
    names = list(
        dict.fromkeys(end for arrow in arrows for end in arrow if end not in {ENTRY, EXIT})
    )
    rank = dict.fromkeys(names, 0)
    for parent, child in arrows:
        if parent in rank and child in rank:
            rank[child] = max(rank[child], rank[parent] + 1)
    rows = {each: [one for one in names if rank[one] == rank[each]].index(each) for each in names}
    keys = {ENTRY: ENTRY, EXIT: EXIT} | {each: f"ex{each:x>10.10}" for each in names}
    actions = tuple(
        Action(
            key=keys[each],
            name=each,
            inputs=((inputs[each],) if inputs and each in inputs else ()),
            position=(280.0 * rows[each], 150.0 * rank[each]),
        )
        for each in names
    )
    relations = tuple(
        Relation(
            parent=keys[parent],
            child=keys[child],
            conditions=ENTRY_CONDITIONS if parent == ENTRY else _ON,
        )
        for parent, child in arrows
    )
    return Graph(name=name, actions=actions, relations=relations)


def line(*names: str) -> list[tuple[str, str]]:
    """Arrows from the entry through all of them to the exit."""
    return list(itertools.pairwise([ENTRY, *names, EXIT]))


def number(name: str) -> Parameter:
    """A number that an action takes."""
    return Parameter(path=name, text='{"pvf_type":"number"}')


class Stage:
    """One robot with its runner, and the time."""

    def __init__(self, script: dict[str, Any], *known: Action) -> None:
        self.network = FakeNetwork()
        self.harness = Harness({ROBOT: FakeLink(self.network, ROBOT)})
        self.script = script_from({"behaviours": script})
        self.index = index_of([codec.write_action(each) for each in known], [])
        self.control: ExecutionService

    def robot(self) -> Node:
        """Add a robot whose engine comes up."""
        robot = EmulatedEngine(
            ROBOT,
            script=self.script,
            index=self.index,
            quirks=EngineTraits(loss=0.0),
            born_ms=now_ms(),
            epoch_ms=harness.EPOCH // 1000,
        )
        return self.network.join(robot)

    async def start(self, task: Graph, *codes: str, reason: str = "") -> str:
        """Let Ada start the graph."""
        override = {"override": Override(codes=codes, reason=reason)} if codes else {}
        asked = order(task, engine=ROBOT, graph=None, version="example", request_id=task.name)
        asked = msgspec.structs.replace(asked, **override)
        return (await self.control.start(asked, ADA)).run.id


Story = Callable[[Stage], Awaitable[None]]


async def wrong_parameter(stage: Stage) -> None:
    """Grip takes a number and gets a word."""
    speed = Parameter(path="speed", text='{"pvf_type":"string","pvf_value":"fast"}')
    task = graph("pack_order", *line("Find", "Approach", "Grip"), inputs={"Grip": speed})
    await stage.start(task, "parameter-type", reason="The new gripper takes words, too.")
    await all_over(stage.control)


async def missing_action(stage: Stage) -> None:
    """The robot has no action Search."""
    task = graph("search_shelf", *line("Look", "Search", "Report"))
    await stage.start(task, "unknown-action", reason="It was installed this morning.")
    await all_over(stage.control)


async def hang_in_a_join(stage: Stage) -> None:
    """Look never comes back, and so Join never begins."""
    arrows = [(ENTRY, "Start"), ("Start", "Drive"), ("Start", "Look"), ("Drive", "Join")]
    task = graph("photo_round", *arrows, ("Look", "Join"), ("Join", EXIT))
    run = await stage.start(task)
    await anyio.sleep(95)
    await stage.control.stop(run, BEN)
    await all_over(stage.control)


async def engine_restart(stage: Stage) -> None:
    """The engine dies on the way, and another one comes up."""
    task = graph("night_watch", *line("Undock", "Patrol", "Dock"))
    await stage.start(task)
    await anyio.sleep(14)
    stage.network.kill(stage.network.nodes[0])
    await anyio.sleep(16)  # discovery has to forget the dead one first
    stage.robot()
    await confirm_lost(stage.control)
    await all_over(stage.control)


async def foreign_start(stage: Stage) -> None:
    """Another person starts a graph of the same name at a terminal."""
    task = graph("inspect", *line("Walk", "Scan"))
    await stage.start(task)
    await anyio.sleep(9)
    text = codec.write(task)
    stage.network.strangers = 1
    stage.network.carry(Start(graph_name="inspect", targets=(ROBOT,), graph_json=text), "terminal")
    await confirm_lost(stage.control)
    await all_over(stage.control)


def _known(*names: str) -> tuple[Action, ...]:
    return tuple(Action(key=each, name=each) for each in names)


STORIES: dict[Story, tuple[dict[str, Any], tuple[Action, ...]]] = {
    wrong_parameter: (
        {"Grip": [{"init_error": True}], "*": [{"after_s": 4.2}]},
        (*_known("Find", "Approach"), Action(key="Grip", name="Grip", inputs=(number("speed"),))),
    ),
    missing_action: ({"*": [{"after_s": 2}]}, _known("Look", "Report")),
    hang_in_a_join: (
        {
            "Look": [{"never": True, "stop_s": 0.4}],
            "Start": [{"after_s": 1}],
            "*": [{"after_s": 6}],
        },
        (),
    ),
    engine_restart: ({"Patrol": [{"after_s": 300}], "*": [{"after_s": 5}]}, ()),
    foreign_start: ({"*": [{"after_s": 40, "stop_s": 0.3}]}, ()),
}


async def played(story: Story, begins: int) -> bytes:
    """A story as the file that is shipped."""
    script, known = STORIES[story]
    harness.EPOCH = begins
    stage = Stage(script, *known)
    async with stage.network.running():
        stage.robot()
        await anyio.sleep(0.5)
        async with stage.harness.runner() as stage.control:
            await anyio.sleep(1.5)
            await story(stage)
    (run,) = [each for each in stage.harness.journal.streams if each.startswith("run/")]
    events = stage.harness.journal.streams[run]
    assert run == stream_of(run.removeprefix("run/"))
    return recorded_runs.written(events)


@contextmanager
def _named(name: str) -> Iterator[None]:
    """Ids are drawn by chance; those of examples are always the same."""
    drawn, start_checks.random_id = start_checks.random_id, lambda: f"example-{name}"
    try:
        yield
    finally:
        start_checks.random_id = drawn


def recorded() -> dict[str, bytes]:
    """Return all examples by the name of their file."""
    files: dict[str, bytes] = {}
    for place, story in enumerate(STORIES):
        name = story.__name__
        files[f"{name}.run.jsonl"] = b""
        begins = MORNING + place * 1_380_000_000
        with _named(name.replace("_", "-")):
            files[f"{name}.run.jsonl"] = run_in_virtual_time(lambda s=story, b=begins: played(s, b))
    harness.EPOCH = 1_800_000_000_000_000
    return files


def main() -> None:
    """Write them where the product finds them."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else examples()
    for name, text in recorded().items():
        (folder / name).write_bytes(text)


if __name__ == "__main__":
    asyncio.set_event_loop_policy(None)
    main()
