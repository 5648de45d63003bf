"""A whole simulation in one call, for the command line and for tests."""

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
    """Everything that happens from the start at 0 ms until nothing is left to happen, `until_ms`
    or `max_events`. `commands`: (ms, `stop` | `pause` | `resume`, running name or None for the top
    graph). `signatures`: the actions that the engine has; without them it has every one. Commands reach the engine as calls, so that two stops at once kill it. A start that the
    engine refuses ends in a hazard `refused`; a trace that is cut off after `max_events` in one more
    event, the hazard `events`."""
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
    """The last event of a trace that has more events than were asked for."""
    message = (
        f"The simulation ends here, after {max_events:,} events; the graph does not. How it goes on is "
        "not known."
    )
    return HazardEvent(engine.now, graph.name, CUT_OFF, "cut off", None, message)


def started(engine: Engine, graph: Graph, states: Mapping[Key, str] | None) -> list[Trace]:
    """The start at 0 ms; one that the engine refuses ends in a hazard."""
    try:
        return engine.start(graph, 0.0, states)
    except GraphRefused as e:
        refused = HazardEvent(0.0, graph.name, "refused", "goes on", None, e.message)
        return [*engine.advance(0.0), refused]


def commanded(engine: Engine, at_ms: float, verb: str, name: str) -> list[Trace]:
    """`stop`, `pause` or `resume` at this moment, of the graph that runs as `name`."""
    match verb:
        case "stop":
            return engine.stop(name, at_ms)
        case "pause":
            return engine.pause(name, at_ms)
        case "resume":
            return engine.resume(name, at_ms)
        case _:
            raise ValueError(f"{verb} is no command; stop, pause and resume are.")
