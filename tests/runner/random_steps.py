"""Random histories: graphs, scripts, and steps that are drawn by chance."""

import random
from collections.abc import Awaitable, Callable, Iterable
from typing import Any

import anyio

from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.umrf.model import Graph
from runner.harness import Harness, carousel, sequence, two_ends

NAME = "David"

GRAPHS: dict[str, Graph] = {
    "one": sequence("one"),
    "two": two_ends("two"),
    "round": carousel("round"),
}

SCRIPTS: list[dict[str, Any]] = [
    {"*": [{"after_s": 0.3}]},
    {"*": [{"never": True}]},
    {"Work_0": [{"after_s": 0.5}], "*": [{"never": True, "stop_s": 1.5}]},
    {"*": [{"after_s": 8, "ignores_stop": True}]},
    {"*": [{"after_s": 3, "ignores_stop": True}]},
    {"*": [{"never": True, "ignores_stop": True}]},
    {"*": [{"never": True, "stop_s": 9.0}]},
    {"*": [{"after_s": 6, "ignores_stop": True, "stop_error": True}]},
    {"Work_0": [{"after_s": 0.3}], "*": [{"after_s": 15, "stop_error": True, "stop_s": 12.0}]},
    {"Work_0": [{"after_s": 0.3, "result": "on_error"}], "*": [{"never": True, "stop_s": 7.0}]},
    {"*": [{"after_s": 1, "result": "on_error"}]},
    {"Work_0": [{"after_s": 0.4}], "*": [{"after_s": 7}]},
    {"Work_0": [{"after_s": 0.1}], "*": [{"after_s": 20, "pauses": False}]},
]

#: Times that an action may take from its trigger until it runs.
LOADING_MS = (1.0, 5.0, 60.0, 400.0, 900.0, 1_500.0, 3_000.0, 8_000.0)

Step = tuple[str, Any]


def random_steps(chance: random.Random) -> list[Step]:
    """Draw steps: (repetitions, step, value)."""
    steps: list[tuple[float, str, Callable[[], Any]]] = [
        (12, "wait", lambda: chance.choice([0.01, 0.05, 0.2, 1.0, 4.0])),
        (7, "start", lambda: chance.choice(list(GRAPHS))),
        (1, "start at once", lambda: chance.choice(list(GRAPHS))),
        (4, "stop", lambda: None),
        (1, "stop all", lambda: None),
        (1, "pause", lambda: None),
        (2, "loss", lambda: (chance.choice(["start", "stop", "get"]), chance.choice([0, 0.3, 0.9]))),
        (1, "late", lambda: chance.choice([0.0, 0.3, 5.0, 60.0])),
        (1, "old", lambda: chance.choice([0.01, 0.8])),
        (0.6, "second engine", lambda: chance.choice([NAME, "Carol"])),
        (0.6, "reboot", lambda: chance.choice(["kill", "quit"])),
        (1, "freeze", lambda: chance.choice([0.5, 2.0, 8.0])),
        (2, "stranger", lambda: chance.choice(["start", "start ours", "stop", "pause"])),
        (2, "made up", lambda: chance.choice(["FINISHED", "STOPPED", "RUNNING"])),
        (1, "journal", lambda: chance.random() < 0.5),
        (0.7, "crash", lambda: None),
        (1.5, "look", lambda: None),
        (1.5, "well", lambda: None),
    ]  # fmt: skip
    drawn = chance.choices(steps, [each[0] for each in steps], k=chance.randint(8, 40))
    return opening(chance) + [(what, value()) for _, what, value in drawn]


def opening(chance: random.Random) -> list[Step]:
    """Draw the first steps: one of the histories that went wrong before, or none."""
    name = chance.choice(list(GRAPHS))
    a_moment = ("wait", chance.choice([0.05, 0.2, 0.5, 1.0]))
    match chance.choice(["twins", "late", "loading", "any", "any"]):
        case "twins":  # both hear the start, one may not hear the stop
            lost = ("loss", ("stop", 0.5))
            return [("second engine", NAME), ("wait", 0.3), ("start", name), a_moment, lost,
                    ("stop", None), ("wait", 1.0)]  # fmt: skip
        case "late":  # somebody else's graph of that name comes first
            late = ("late", chance.choice([5.0, 60.0]))
            return [late, ("start", name), a_moment, ("their start", name), ("wait", 4.0)]
        case "loading":
            return [("start", name), a_moment, ("stop", None), ("wait", 1.0)]
        case _:
            return [("start", name)]


async def live_through(
    harness: Harness,
    steps: Iterable[Step],
    judge: Callable[[OpenRun], None],
    do: Callable[[ExecutionService, Any, str, Any], Awaitable[None]],
) -> None:
    """Play all steps in their order; at a "crash" the process dies and another one continues."""
    rest = list(steps)
    while rest:
        async with harness.runner() as control, anyio.create_task_group() as people:
            control.watch(judge)
            while rest:
                step, value = rest.pop(0)
                if step == "crash":
                    break
                await do(control, people, step, value)
            harness.journal.down = True  # a crash writes nothing any more
            people.cancel_scope.cancel()
        harness.journal.down = False
