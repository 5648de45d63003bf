"""Behaviours and graphs for tests, and what is left of their processes."""

import itertools
import os
import textwrap
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import psutil

from action_assistant.runner.links.behaviours import call_program
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Graph,
    Parameter,
    Relation,
)
from runner.harness import GO_ON

#: Nobody looks for a program there. What we start has it in its environment, however it is orphaned;
#: other processes that run such tests have another one.
_OURS = f"/nowhere/{os.getpid()}"
os.environ["PATH"] += os.pathsep + _OURS

OK = "def run(action):\n    return True\n"
#: Neither sleeps nor hears of a stop.
DEAF = "def run(action):\n    while True:\n        pass\n"
#: Waits for its stop, and obeys it.
WAITS = "def run(action):\n    while action.sleep(3600):\n        pass\n"


def write(folder: Path, **sources: str) -> Path:
    """A file for each; the folder."""
    folder.mkdir(exist_ok=True)
    for name, source in sources.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(source))
    return folder


def parameter(name: str, kind: str, value: Any = None, **more: Any) -> Parameter:
    """Return a parameter of an action; without a value a person has to give it."""
    leaf = {"pvf_type": kind, **({} if value is None else {"pvf_value": value}), **more}
    return Parameter(path=name.replace("::", "/"), text=msgspec.json.encode(leaf).decode())


def action(
    name: str, inputs: Sequence[Parameter] = (), outputs: Sequence[Parameter] = ()
) -> Action:
    """The only one of its name."""
    return Action(key=f"aid{name}", name=name, inputs=tuple(inputs), outputs=tuple(outputs))


def chain(*actions: Action | str, name: str = "chain") -> Graph:
    """One after the other, whatever becomes of each."""
    nodes = tuple(each if isinstance(each, Action) else action(each) for each in actions)
    keys = [ENTRY, *(each.key for each in nodes), EXIT]
    pairs = itertools.pairwise(keys)
    relations = tuple(
        Relation(parent=a, child=b, conditions=ENTRY_CONDITIONS if a == ENTRY else GO_ON)
        for a, b in pairs
    )
    return Graph(name=name, actions=nodes, relations=relations)


def side_by_side(count: int, source: str, name: str = "wide") -> Graph:
    """Return a graph with `count` copies of an action beside each other, each of which leads to
    the exit."""
    nodes = tuple(Action(key=f"aid{i}", name=source, instance_id=i) for i in range(count))
    entries = [Relation(parent=ENTRY, child=n.key, conditions=ENTRY_CONDITIONS) for n in nodes]
    exits = [Relation(parent=each.key, child=EXIT, conditions=GO_ON) for each in nodes]
    return Graph(name=name, actions=nodes, relations=(*entries, *exits))


def processes() -> list[psutil.Process]:
    """Return the processes of running behaviours and of their supervisors that this test process began."""
    found = []
    for each in psutil.process_iter():
        with suppress(psutil.Error):
            ours = str(Path(call_program.__file__)) in each.cmdline()
            if ours and each.environ().get("PATH", "").endswith(_OURS):
                found.append(each)
    return found


def until(true: Callable[[], Any], patience: float = 30.0) -> Any:
    """Wait for something that must happen; what it gave."""
    deadline = time.monotonic() + patience
    while not (found := true()):
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)
    return found
