"""Runs a whole simulation in one call, for the command line, courses and tests."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from action_assistant.umrf.facts import SIMULATED, EngineFacts
from action_assistant.umrf.model import Graph, Key, Signature
from action_assistant.umrf.semantics.engine import Engine
from action_assistant.umrf.semantics.graphs import GraphRefused
from action_assistant.umrf.semantics.script import Script
from action_assistant.umrf.semantics.trace import HazardEvent, Trace

DAY_MS: Final = 86_400_000.0
#: The code of the last event of a trace that has more events than were asked for.
CUT_OFF: Final = "events"


def simulate(
    graph: Graph,
    *,
    script: Script | None = None,
    library: Mapping[str, Graph] | None = None,
    facts: EngineFacts = SIMULATED,
    commands: Iterable[tuple[float, str, str | None]] = (),
    until_ms: float = DAY_MS,
    max_events: int = 100_000,
    states: Mapping[Key, str] | None = None,
    actor: str = "",
    signatures: Mapping[str, Signature] | None = None,
) -> Iterator[Trace]:
    """Simulate a graph from its start at 0 ms, and yield the trace events in order. The trace ends
    when nothing more will happen, at `until_ms`, or after `max_events` events; a trace that is cut
    off by `max_events` ends with one more event, the hazard `events`. If the engine refuses the
    start, the hazard `refused` is reported.

    `script`: how the actions behave. `library`: the graphs that can be sub-graphs, by name.
    `facts`: the engine build. `commands`: (time in ms, `stop` | `pause` | `resume`, running name,
    or None for the top graph); commands reach the engine as direct calls, so that a second stop
    during a stop kills it. `states`: run states with which nodes begin, by key. `actor`: the
    engine's name. `signatures`: the actions that the engine has; without them it has every action.
    """
    engine = Engine(
        facts=facts,
        script=script,
        library=library,
        actor=actor,
        signatures=signatures,
        serial=False,
    )
    pending = sorted(commands, key=lambda command: command[0])
    traces = started(engine, graph, states)
    left = max_events
    while True:
        yield from traces[:left]
        if len(traces) > left:
            break
        left -= len(traces)
        if engine.crashed:
            return
        due = engine.due
        if pending and (due is None or pending[0][0] <= due):
            at_ms, verb, name = pending.pop(0)
            if at_ms > until_ms:
                return
            traces = engine.advance(at_ms) + commanded(engine, at_ms, verb, name or graph.name)
        elif due is None or due > until_ms:
            return
        else:
            traces = engine.advance(due)
    yield cut_off(engine, graph, max_events)


def cut_off(engine: Engine, graph: Graph, max_events: int) -> Trace:
    """Return the hazard event that ends the trace of a graph which was cut off after `max_events`
    events."""
    message = (
        f"The simulation ends here, after {max_events:,} events; the graph does not. How it goes on is "
        "not known."
    )
    return HazardEvent(engine.now, graph.name, CUT_OFF, "cut off", None, message)


def started(engine: Engine, graph: Graph, states: Mapping[Key, str] | None) -> list[Trace]:
    """Start a graph at 0 ms, and return the trace so far. `states`: run states with which nodes
    begin, by key, or None. If the engine refuses the start, the trace ends in the hazard `refused`.
    """
    try:
        return engine.start(graph, 0.0, states)
    except GraphRefused as e:
        refused = HazardEvent(0.0, graph.name, "refused", "goes on", None, e.message)
        return [*engine.advance(0.0), refused]


def commanded(engine: Engine, at_ms: float, verb: str, name: str) -> list[Trace]:
    """Give the engine the command `verb` (`stop`, `pause` or `resume`) at this time for the graph
    that runs as `name`, and return the trace up to then. Raise `ValueError` for any other verb."""
    match verb:
        case "stop":
            return engine.stop(name, at_ms)
        case "pause":
            return engine.pause(name, at_ms)
        case "resume":
            return engine.resume(name, at_ms)
        case _:
            raise ValueError(f"{verb} is no command; stop, pause and resume are.")
