"""A repeat: one start that is carried out once for each of its cells, one after the other. Pure.

Its stream `repeat/ID` says what was ordered, and when the repeat was closed and opened again. Its cells
are runs, which name it: nothing else says that a cell was started. Times are
microseconds UTC.
"""

import hashlib
import itertools
import random
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, ClassVar, Final, TypeAlias

import msgspec

from action_assistant.errors import BadInput
from action_assistant.journal.events import Event
from action_assistant.runner.runs.doubts import ClosedWhy
from action_assistant.runner.runs.events import Author
from action_assistant.runner.start.admission import StartRequest, Watching
from action_assistant.runner.start.kept_starts import graph_of, ordered_in, start_of
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.start_values import StartValues, Value, WrongValue, with_values

#: The most cells of one repeat.
MOST: Final = 500
_MOST_BYTES: Final = 200_000  # of the values of all cells
_PREFIX: Final = "repeat/"

_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=1000)]


class Axis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An input of a grid, by the full name of its action and its flat name, with the values that it gets
    in turn."""

    action: _Name
    name: _Name
    values: Annotated[tuple[Value, ...], msgspec.Meta(min_length=1, max_length=100)]


class RepeatRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Opens a repeat of a start. `times`: how often each cell of the `grid` is carried out, or the start
    itself where there is none. `seed`: the cells of each round come in an order made of it; without one in
    that of the grid. `by_itself`: in the simulator alone, the next run starts when the one before has
    ended true. The `request_id` of the start names the repeat: it is opened once."""

    start: StartRequest
    times: Annotated[int, msgspec.Meta(ge=1, le=MOST)] = 1
    grid: Annotated[tuple[Axis, ...], msgspec.Meta(max_length=6)] = ()
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**53 - 1)] | None = None
    by_itself: bool = False


class NextRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Says that everything is set back, and starts the cell with this number, the next one as the person
    saw it. `watching`: as in `StartRequest`."""

    cell: Annotated[int, msgspec.Meta(ge=1, le=MOST)]
    watching: Watching = {}


class CellLookRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Asks for the pre-flight of the next cell of a repeat as it is now. `watching`: as in
    `StartRequest`."""

    watching: Watching = {}


class ReopenRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Opens a closed repeat again after a look. `closings`: how often it was closed, as the person saw it;
    `watching`: as in `StartRequest`."""

    closings: Annotated[int, msgspec.Meta(ge=0, le=1_000_000)]
    watching: Watching = {}


class RepeatOpened(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A person opened a repeat; it starts nothing by itself on a robot. `robots`: those that may move;
    `cells`: the values of each run, in order; `order`: the hash of all that was ordered; `inside`,
    `unsighted`: as of a run."""

    kind: ClassVar[str] = "repeat.opened.v1"

    at: int
    repeat: str
    order: str
    author: Author
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    robots: tuple[str, ...]
    cells: tuple[StartValues, ...]
    times: int = 1
    grid: tuple[Axis, ...] = ()
    seed: int | None = None
    by_itself: bool = False
    inside: tuple[str, ...] = ()
    unsighted: bool = False


class StartKept(msgspec.Struct, frozen=True):
    """The start that a repeat carries out, as it was sent, with its graph."""

    kind: ClassVar[str] = "repeat.start_kept.v1"

    start: msgspec.Raw


class RepeatClosed(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A repeat was closed: no more of its cells are started. `by`: the person who caused it; `run`: the run that did."""

    kind: ClassVar[str] = "repeat.closed.v1"

    at: int
    why: ClosedWhy
    text: str
    by: Author | None = None
    run: str = ""


class RepeatReopened(msgspec.Struct, frozen=True, kw_only=True):
    """A person has looked, and opened a repeat again."""

    kind: ClassVar[str] = "repeat.reopened.v1"

    at: int
    author: Author


RepeatEvent: TypeAlias = RepeatOpened | RepeatClosed | RepeatReopened
_KINDS: Final[Mapping[str, type[RepeatEvent]]] = {
    each.kind: each for each in (RepeatOpened, RepeatClosed, RepeatReopened)
}


class Repeat(msgspec.Struct, frozen=True, kw_only=True):
    """A repeat, folded from its events. `closed`: why it is closed, None while it is open; `closings`: how
    often it was closed; `reopened`: when it was opened again the last time, and by whom."""

    opened: RepeatOpened
    closed: RepeatClosed | None = None
    closings: int = 0
    reopened: RepeatReopened | None = None

    @property
    def id(self) -> str:
        """The id of the repeat."""
        return self.opened.repeat


def stream_of(repeat: str) -> str:
    """Return the name of the stream of a repeat."""
    return f"{_PREFIX}{repeat}"


def follow(repeat: Repeat | None, event: RepeatEvent) -> Repeat | None:
    """Return a repeat after one more event; None before it was opened."""
    if isinstance(event, RepeatOpened):
        return Repeat(opened=event) if repeat is None else repeat
    if repeat is None:
        return None
    if isinstance(event, RepeatReopened):
        return msgspec.structs.replace(repeat, closed=None, reopened=event)
    return msgspec.structs.replace(repeat, closed=event, closings=repeat.closings + 1)


def replay(events: Iterable[tuple[str, bytes]]) -> Repeat | None:
    """Return a repeat, folded from its events, each given as its kind and body; None if the event
    that opened the repeat is missing. Events of kinds that this version does not know are skipped.
    Raise msgspec.DecodeError for a damaged body."""
    found: Repeat | None = None
    for kind, body in events:
        known = _KINDS.get(kind)
        if known is not None:
            found = follow(found, msgspec.json.decode(body, type=known))
    return found


def start_in(events: Iterable[Event]) -> StartRequest:
    """Return the start that a repeat carries out. Raise msgspec.DecodeError if it is not among the events
    or damaged."""
    kept = next((each.body for each in events if each.kind == StartKept.kind), b"")
    return start_of(msgspec.json.decode(kept, type=StartKept).start)


def repeat_id(request_id: str) -> str:
    """Return the id of the repeat that the start with this request id orders."""
    return hashlib.sha256(f"repeat {request_id}".encode()).hexdigest()[:22]


def order_of(request: RepeatRequest) -> str:
    """Return the hash of all that a repeat orders."""
    start = ordered_in(request.start)
    rest = [request.times, request.grid, request.seed, request.by_itself]
    return hashlib.sha256(start + msgspec.json.encode(rest)).hexdigest()


def cells_of(request: RepeatRequest) -> tuple[StartValues, ...]:
    """Return the values of each run of a repeat, in order. Raise BadInput if these are too many, or an
    input comes twice."""
    seen = {(action, name) for action, given in request.start.values.items() for name in given}
    count = request.times
    for number, axis in enumerate(request.grid):
        if (axis.action, axis.name) in seen:
            text = f"{axis.name} of {axis.action} has a value already."
            raise BadInput(text, where={"path": f"/grid/{number}"})
        seen.add((axis.action, axis.name))
        count *= len(axis.values)
    if count > MOST:
        where: dict[str, object] = {"path": "/grid" if request.grid else "/times"}
        raise BadInput(f"A repeat has at most {MOST} runs; these are {count:,}.", where=where)
    if count * len(as_json(request.start.values)) + _grid_bytes(request.grid, count) > _MOST_BYTES:
        text = f"The values of a repeat have {_MOST_BYTES:,} bytes at most."
        raise BadInput(text, where={"path": "/grid"})
    grid = [
        _given(request.start.values, request.grid, values)
        for values in itertools.product(*(axis.values for axis in request.grid))
    ]
    chance = None if request.seed is None else random.Random(request.seed)
    cells: list[StartValues] = []
    for _ in range(request.times):
        cells += grid if chance is None else chance.sample(grid, len(grid))
    return tuple(cells)


def _grid_bytes(grid: Sequence[Axis], count: int) -> int:
    """Return how many bytes the values of a grid are in `count` cells, as JSON."""
    return sum(
        count // len(axis.values) * sum(len(as_json(value)) for value in axis.values)
        + count * (len(axis.action) + len(axis.name))
        for axis in grid
    )


def _given(values: StartValues, grid: Sequence[Axis], chosen: Sequence[Value]) -> StartValues:
    found = {action: dict(given) for action, given in values.items()}
    for axis, value in zip(grid, chosen, strict=True):
        found.setdefault(axis.action, {})[axis.name] = value
    return found


def named(request: RepeatRequest, cells: Sequence[StartValues]) -> str:
    """Return the name of the graph of a repeat after a look at the values of all cells. For workers. Raise
    BadInput for a value that an input cannot have, Conflict for another digest, NotUmrf or TooLarge for
    a graph that cannot be read."""
    graph = graph_of(request.start)
    for number, values in enumerate(cells, 1):
        try:
            with_values(graph, values)
        except WrongValue as wrong:
            place = next(
                (
                    f"/grid/{axis}"
                    for axis, each in enumerate(request.grid)
                    if (each.action, each.name) == (wrong.action, wrong.name)
                ),
                f"/start{wrong.path}",
            )
            where: dict[str, object] = {"path": place, "cell": number}
            raise BadInput(str(wrong), where=where) from wrong
    return graph.name
