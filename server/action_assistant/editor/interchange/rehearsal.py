"""Simulates a graph by the engine's rules, without recording anything."""

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

import msgspec

from action_assistant.editor.documents.contents import (
    NOTHING_INSIDE,
    GraphAtSeq,
    Inside,
    graphs_of,
    read,
)
from action_assistant.errors import BadInput, Conflict
from action_assistant.umrf import semantics
from action_assistant.umrf.check import refused_by_parser
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.partial_runs import NoPart, partial_graph
from action_assistant.umrf.start_values import (
    AskedInput,
    StartValues,
    WrongValue,
    asked_inputs,
    with_values,
)

EVENTS: Final = 4_000  # of one rehearsal; the page shows no more
HOUR_MS: Final = 3_600_000.0
_SCRIPT_LIMIT: Final = 500  # behaviours


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A command of a person to the running graph, and its time."""

    at_ms: float
    verb: Literal["stop", "pause", "resume"]


class RehearsedPart(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The part of a graph that is simulated: the actions `at`, by full name, and all that may follow, or
    `only` these."""

    at: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=200)]
    only: bool = False


class Rehearsing(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"start_from": "from"}
):
    """A request to simulate the graph after its change `seq` (missing: the newest). `script`: what
    its actions do, as in a script of `simulate`; `commands`: what people do during the run;
    `values`: those of inputs for which a start asks; `from`: where it begins, if not at the entry."""

    seq: int | None = None
    script: Annotated[Any, semantics.SCRIPT] = None
    commands: tuple[Command, ...] = ()
    for_ms: float = HOUR_MS
    values: StartValues = {}
    start_from: RehearsedPart | None = None


class Rehearsal(msgspec.Struct, frozen=True):
    """The events of a simulated run, in order. `cut`: the list is incomplete; `asked`: the inputs
    for which a start of the graph asks."""

    seq: int
    trace: tuple[semantics.Trace, ...]
    cut: bool
    asked: tuple[AskedInput, ...] = ()


def rehearsed(sight: GraphAtSeq, wanted: Rehearsing, inside: Inside = NOTHING_INSIDE) -> bytes:
    """Simulate a graph at a change (`sight`), with the graphs `inside`, to its end or up to a
    limit; return the JSON of a `Rehearsal`. `wanted`: the script and the commands. Call it in a
    worker process. Raise BadInput for a bad request, Conflict if the graph cannot be simulated."""
    script = _script(wanted.script)
    if not 0 < wanted.for_ms <= 24 * HOUR_MS:
        raise BadInput("A rehearsal lasts up to a day.", where={"path": "/for_ms"})
    if len(wanted.commands) > 100:
        raise BadInput("A rehearsal takes up to 100 commands.", where={"path": "/commands"})
    graph = _part(read(sight).moment.graph, wanted.start_from)
    filled = _given(graph, wanted.values)
    found = _played(sight.seq, filled, graphs_of(inside), script, wanted)
    return msgspec.json.encode(msgspec.structs.replace(found, asked=asked_inputs(graph)))


def _part(graph: Graph, wanted: RehearsedPart | None) -> Graph:
    if wanted is None:
        return graph
    try:
        return partial_graph(graph, wanted.at, {}, only=wanted.only).graph
    except NoPart as error:
        raise BadInput(str(error), where={"path": "/from/at"}) from error


def _given(graph: Graph, values: StartValues) -> Graph:
    try:
        return with_values(graph, values)
    except WrongValue as error:
        raise BadInput(str(error), where={"path": error.path}) from error


def _script(value: Any) -> semantics.Script:
    if value is None:
        return semantics.Script({})
    try:
        script = semantics.script_from(value)
    except ValueError as error:
        raise BadInput(str(error), where={"path": "/script"}) from error
    if sum(len(calls) for calls in script.behaviours.values()) > _SCRIPT_LIMIT:
        raise BadInput(
            f"A script for a rehearsal has up to {_SCRIPT_LIMIT} behaviours.",
            where={"path": "/script"},
        )
    return script


def _refuse_unreadable(graph: Graph) -> None:
    """Raise Conflict for a graph that the engine's parser would refuse, since it cannot be simulated."""
    refusals = refused_by_parser(codec.Reading(graph=graph, dialect="D3"))
    if refusals:
        raise Conflict(f"The engine would refuse this graph: {refusals[0].message}")


def _played(
    seq: int,
    graph: Graph,
    inside: Mapping[str, Graph],
    script: semantics.Script,
    wanted: Rehearsing,
) -> Rehearsal:
    _refuse_unreadable(graph)
    trace = tuple(
        semantics.simulate(
            graph,
            script=script,
            library=inside,
            commands=[(command.at_ms, command.verb, None) for command in wanted.commands],
            until_ms=wanted.for_ms,
            max_events=EVENTS + 1,
        )
    )
    return Rehearsal(seq, trace[:EVENTS], len(trace) > EVENTS)
