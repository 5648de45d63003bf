"""Simulates a whole run with behaviours in one call: `umrf.semantics.simulate` in real time."""

import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from math import inf

from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import BehaviourPerformer
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import Graph, Key, Signature
from action_assistant.umrf.semantics import Engine, Script, Trace
from action_assistant.umrf.semantics.simulate import commanded, cut_off, started


def simulate_in_real_time(
    graph: Graph,
    folder: BehaviourFolder,
    *,
    script: Script,
    library: Mapping[str, Graph],
    commands: Iterable[tuple[float, str, str | None]],
    until_ms: float,
    max_events: int,
    states: Mapping[Key, str],
    signatures: Mapping[str, Signature] | None = None,
) -> Iterator[Trace]:
    """Play a graph with the behaviours in `folder`, and yield every event from its start until
    nothing is left to do, until `until_ms`, or for `max_events` events. It takes real time: the
    generator waits between events. `script`: how actions without a behaviour act; `library`: the
    sub-graphs by name; `commands`: (ms, verb, graph name or None), as for
    `umrf.semantics.simulate`; `states`: those in which nodes begin; `signatures`: of actions, by
    name. Behaviours that still run at the end are killed."""
    performer, news = BehaviourPerformer(folder), threading.Event()
    performer.wake = news.set
    engine = Engine(
        facts=SIMULATED,
        script=script,
        library=library,
        signatures=signatures,
        serial=False,
        performer=performer,
    )
    began, left = time.monotonic(), max_events
    pending = sorted(commands, key=lambda command: command[0])
    try:
        traces = started(engine, graph, states)
        while True:
            yield from traces[:left]
            if len(traces) > left:
                yield cut_off(engine, graph, max_events)
            left -= len(traces)
            now = (time.monotonic() - began) * 1000
            over = engine.due is None and not pending and not performer.is_busy
            if engine.crashed or over or left < 0 or now > until_ms:
                return
            due = min(until_ms, pending[0][0] if pending else inf, _due(engine))
            news.wait(max(0.0, due - now) / 1000)
            news.clear()
            traces = _next(engine, performer, pending, (time.monotonic() - began) * 1000, graph)
    finally:
        performer.end()


def _due(engine: Engine) -> float:
    return inf if engine.due is None else engine.due


def _next(
    engine: Engine,
    performer: BehaviourPerformer,
    pending: list[tuple[float, str, str | None]],
    now: float,
    graph: Graph,
) -> list[Trace]:
    """Process what is due at `now` (ms): commands, which are removed from `pending`, results of
    behaviours, and steps of the engine. Return the events. `graph`: the one that a command without
    a name is for."""
    traces: list[Trace] = []
    while pending and pending[0][0] <= now:
        at_ms, verb, name = pending.pop(0)
        traces += commanded(engine, max(at_ms, engine.now), verb, name or graph.name)
    for returned in performer.taken():
        traces += engine.returned(returned, now)
    return traces + engine.advance(now)
