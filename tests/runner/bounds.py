"""Runs on an emulated robot, with what the code of its actions really did beside what was recorded."""

from collections.abc import Sequence
from typing import Any

import anyio
import msgspec

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, index_of
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.runs.visits import Visit
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import ENTRY, ENTRY_CONDITIONS, EXIT, Conditions, Graph, Relation
from action_assistant.umrf.semantics import NodeStateEvent, script_from
from runner import harness
from runner.fake_network import now_ms
from runner.harness import BEN, GO_ON, carousel, run_in_virtual_time, sequence, two_ends
from runner.record_streams import Place
from runner.robots_in_network import all_over

#: One execution of an action's code: microseconds of its begin and its end; None: it went on.
Real = tuple[int, int | None]


class NetworkFaults(msgspec.Struct, frozen=True, kw_only=True):
    """The rates at which messages get lost, and their delays."""

    loss: float = 0.0
    get_loss: float = 0.0
    old_s: float = 0.0
    feedback_s: float = 0.0
    seed: int = 0


class Lived(msgspec.Struct, frozen=True):
    """A run as it was recorded, and the truth."""

    run: Run
    place: Place
    real: dict[str, list[Real]]


def join(name: str = "join") -> Graph:
    """`Work_0` and `Work_1` at once, then `Work_2`, which waits for both."""
    line = sequence(name, 3)
    first, second, last = (action.key for action in line.actions)
    defaults = Conditions(on_true="run", on_false="run", on_error="bypass")
    arrows = [(ENTRY, first), (ENTRY, second), (first, last), (second, last), (last, EXIT)]
    relations = tuple(
        Relation(
            parent=parent,
            child=child,
            conditions=ENTRY_CONDITIONS
            if parent == ENTRY
            else GO_ON
            if child == EXIT
            else defaults,
        )
        for parent, child in arrows
    )
    return msgspec.structs.replace(line, relations=relations)


def _stuck() -> Graph:
    """One whose first action leads nowhere: it halts, and its parent is never told."""
    line = sequence("Stuck", 2)
    last = line.actions[1].key
    arrows = tuple(
        msgspec.structs.replace(each, conditions=Conditions()) if each.child == last else each
        for each in line.relations
    )
    return msgspec.structs.replace(line, relations=arrows)


#: The inner graphs that a robot has indexed.
INSIDE = (sequence("Sub", 2), _stuck())


def around(name: str = "around", inside: str = "Sub", *, again: bool = False) -> Graph:
    """`Work_0`, then a graph of two actions, then `Work_2`; `again`: and from the start."""
    line = sequence(name, 3)
    first, inner, last = line.actions
    actions = (first, msgspec.structs.replace(inner, name=inside), last)
    if again:
        back = Relation(parent=last.key, child=first.key, conditions=GO_ON, required=False)
        arrows = tuple(each for each in line.relations if each.child != EXIT)
        line = msgspec.structs.replace(line, relations=(*arrows, back))
    return msgspec.structs.replace(line, actions=actions)


GRAPHS = {
    "line": lambda: sequence("line", 4),
    "join": join,
    "loop": carousel,
    "ends": two_ends,
    "sub": around,
    "stuck": lambda: around("stuck", "Stuck"),
    "sub_loop": lambda: around("sub_loop", again=True),
}


def lived(graph: str, script: dict[str, Any], network: NetworkFaults, stop: float | None) -> Lived:
    """A run of that graph, stopped after so many seconds, up to its end or for some time."""
    found: Lived = run_in_virtual_time(lambda: _lived(GRAPHS[graph](), script, network, stop))
    return found


async def _lived(
    graph: Graph, script: dict[str, Any], network: NetworkFaults, stop: float | None
) -> Lived:
    place = Place(script)
    place.network.chance.seed(network.seed)
    place.network.loss["get"] = network.get_loss
    place.network.old_s, place.network.feedback_s = network.old_s, network.feedback_s
    robot = EmulatedEngine(
        "Robin",
        script=script_from({"behaviours": script}),
        index=index_of([], [codec.write(each) for each in INSIDE]),
        quirks=EngineTraits(loss=network.loss),
        seed=network.seed,
        born_ms=now_ms(),
        epoch_ms=harness.EPOCH // 1000,
    )
    traces: list[NodeStateEvent] = []
    take = robot._take

    def overheard(told: Any) -> None:
        traces.extend(each for each in told if isinstance(each, NodeStateEvent))
        take(told)

    robot._take = overheard  # type: ignore[method-assign]
    async with place.network.running():
        place.network.join(robot, "/Robin")
        await anyio.sleep(0.5)
        async with place.harness.runner() as place.control:
            await anyio.sleep(1.5)
            run = await _started(place, graph)
            with anyio.move_on_after(40):
                if stop is not None:
                    await anyio.sleep(stop)
                    await place.control.stop(run, BEN)
                await all_over(place.control)
            history = place.harness.journal.history(run)
    real = {name: _real(*_inside(graph.name, name), traces, script) for name in history.actions}
    return Lived(history, place, real)


def _inside(graph: str, name: str) -> tuple[str, str]:
    """The running graph of an action of a run, and its name there."""
    around, _, node = name.rpartition("/")
    return around or graph, node


def _sent_inside(graph: Graph) -> tuple[SentSubgraph, ...]:
    names = {each.name for each in graph.actions}
    return tuple(
        SentSubgraph(
            name=each.name, digest=digest(each), umrf=msgspec.Raw(codec.write(each).encode())
        )
        for each in INSIDE
        if each.name in names
    )


OVERRIDDEN = ("quiet", "others", "actions", "actors", "H5", "H8", "unknown-action", "subgraphs")


async def _started(place: Place, graph: Graph) -> str:
    """Answers may be lost before the start, too; then a person tries again."""
    from action_assistant.errors import Refused

    for _ in range(20):
        try:
            override = Override(codes=OVERRIDDEN, reason="it is a test")
            return await place.start(graph, override=override, subgraphs=_sent_inside(graph))
        except Refused:
            await anyio.sleep(1)
    raise AssertionError("it could not be started")


def _real(
    graph: str, name: str, traces: list[NodeStateEvent], script: dict[str, Any]
) -> list[Real]:
    """Return when the code of an action ran. Code that ignores a stop goes on after the engine has
    given it up."""
    found: list[Real] = []
    state = ""
    for trace in (each for each in traces if (each.graph, each.node) == (graph, name)):
        at = harness.EPOCH + round(trace.t_ms * 1000)
        if trace.state == "RUNNING":
            found.append((at, None))
        elif trace.state in {"FINISHED", "ERROR"} and found and found[-1][1] is None:
            calls = script.get(name) or script.get("*") or [{}]
            call = calls[min(len(found), len(calls)) - 1]
            begun = found[-1][0]
            end: int | None = at
            if trace.state == "ERROR" and state == "STOPPING":
                end = None if call.get("never") else begun + round(call.get("after_s", 1) * 1e6)
            found[-1] = (begun, end)
        state = trace.state
    return found


def fits(visit: Visit, real: Real) -> bool:
    """Return whether a visit may be this execution: all of it lies within the bounds."""
    begun, over = real
    if not visit.not_before <= begun <= visit.start:
        return False
    if visit.until is None:
        return True
    if over is None:
        return visit.not_after is None
    return visit.until <= over <= (visit.not_after if visit.not_after is not None else over)


def fit_apart(visits: Sequence[Visit], real: Sequence[Real]) -> bool:
    """Return whether all of these visits may be executions, each another one."""
    taken: dict[int, int] = {}

    def place(visit: int, tried: set[int]) -> bool:
        for each in range(len(real)):
            if each not in tried and fits(visits[visit], real[each]):
                tried.add(each)
                if each not in taken or place(taken[each], tried):
                    taken[each] = visit
                    return True
        return False

    return all(place(visit, set()) for visit in range(len(visits)))
