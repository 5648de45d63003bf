"""An entry of the queue: one start that waits for its robots. Pure.

Its stream `queue/ID` says who put it there, what was looked at, and how it left the queue; the stream
`queue-robot/NAME` says when the queue of a robot was closed, and opened again. Times are microseconds UTC.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import BadInput, Conflict, Unavailable
from action_assistant.journal.events import Event
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.doubts import ClosedWhy
from action_assistant.runner.runs.events import Author
from action_assistant.runner.start.admission import StartRequest, Watching
from action_assistant.runner.start.kept_starts import ordered_in, require_form, start_of
from action_assistant.runner.start.orders import engines_of, graphs_inside
from action_assistant.runner.start.preflight import Item, Preflight
from action_assistant.umrf.start_values import StartValues

#: The most entries, of everybody and of one person.
MOST: Final = 100
MOST_OF_ONE: Final = 50
_PREFIX: Final = "queue/"
_ROBOT_PREFIX: Final = "queue-robot/"

#: Items of a pre-flight that change while a start waits: about other runs on the robot, and what its
#: person says or does at the start itself.
_OF_THE_MOMENT: Final = frozenset(
    {"free", "again", "quiet", "rest", "baton", "confirm", "watched", "present", "approved"}
)
#: Of these, those that may be missing when a queue is opened: nothing starts by that.
_AT_THE_START: Final = frozenset({"free", "confirm", "watched", "present", "approved"})
#: Figures change by themselves between two looks: ages, levels of a battery.
_FIGURE: Final = re.compile(r"(?<!\w)\d+([.,]\d+)*")  # no part of a name
_WORSE: Final = {"passed": 0, "warned": 1, "blocked": 2}

_Id = Annotated[str, msgspec.Meta(max_length=100)]


class QueueRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Puts a start into the queue. `by_itself`: in the simulator alone, it starts when its turn comes.
    The `request_id` of the start names the entry: it is put there once. `engines`: of a start on several
    robots all of these, the `engine` of the start among them; each gets the whole graph."""

    start: StartRequest
    by_itself: bool = False
    engines: Annotated[tuple[_Id, ...], msgspec.Meta(max_length=20)] = ()

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots for which it waits, sorted."""
        return self.each_whole or engines_of(self.start)

    @property
    def each_whole(self) -> tuple[str, ...]:
        """The robots of a start on several robots, sorted; none for any other start."""
        return tuple(sorted(set(self.engines)))


class LookRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Asks for the pre-flight of an entry as it is now. `watching`: as in `StartRequest`."""

    watching: Watching = {}


class TurnRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Starts an entry whose turn it is. `look`: that of the newest look, as the person saw it;
    `watching`: as in `StartRequest`."""

    look: Annotated[str, msgspec.Meta(max_length=100)]
    watching: Watching = {}


class MoveRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Moves an entry. `before`: the id of the entry that comes after it then, "" for the end."""

    before: _Id = ""


class OpenQueueRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Opens the closed queue of a robot again after a look. `closing`: that of the queue, as the person
    saw it."""

    closing: _Id


class Looked(msgspec.Struct, frozen=True, omit_defaults=True):
    """The part of a pre-flight that has to stay as it is. `items`: the verdicts by engine and code,
    but those of the moment; `rules`: of each robot, as JSON; `tree_digest`: of what was looked at."""

    items: dict[str, dict[str, str]]
    rules: dict[str, str] = {}
    tree_digest: str = ""


class QueueEntered(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A person put a start into the queue; nothing was started by it. `robots`: those that it waits for,
    none for one in the simulator; `engines`: those of a start on several robots, sorted, none for any
    other; `order`: the hash of all that was ordered; `seen`: the look of its person; `inside`,
    `unsighted`: as of a run."""

    kind: ClassVar[str] = "queue.entered.v1"

    at: int
    entry: str
    request_id: str
    order: str
    author: Author
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    robots: tuple[str, ...]
    seen: Looked
    engines: tuple[str, ...] = ()
    values: StartValues = {}
    by_itself: bool = False
    inside: tuple[str, ...] = ()
    unsighted: bool = False

    @property
    def together(self) -> tuple[str, ...]:
        """The robots that get the whole graph together; none for a start on one, or that of a led run. Only
        what was asked for says that: a cast names robots, too."""
        return self.engines if len(self.engines) > 1 else ()

    @property
    def requests(self) -> tuple[str, ...]:
        """The request ids of the runs that it may become."""
        whole = request_of(self.entry)
        return tuple(f"{whole}/{robot}" for robot in self.together) or (whole,)


class QueueStartKept(msgspec.Struct, frozen=True):
    """The start of an entry as it was sent, with its graph."""

    kind: ClassVar[str] = "queue.start_kept.v1"

    start: msgspec.Raw


class QueueReady(msgspec.Struct, frozen=True, kw_only=True):
    """The turn of an entry came: its robots were free, and it was the first. Nothing was started by
    that."""

    kind: ClassVar[str] = "queue.ready.v1"

    at: int
    person: str
    graph: str | None
    graph_name: str
    robots: tuple[str, ...]


class QueueMoved(msgspec.Struct, frozen=True, kw_only=True):
    """A person moved an entry. `order`: the ids of all entries after that."""

    kind: ClassVar[str] = "queue.moved.v1"

    at: int
    author: Author
    order: tuple[str, ...]


class QueueLeft(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An entry left the queue: a `run` was made of it, or the person `by` removed it."""

    kind: ClassVar[str] = "queue.left.v1"

    at: int
    run: str = ""
    by: Author | None = None


class QueueClosed(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The queue of a robot was closed: nothing of it is started. `by`: the person who caused it; `run`:
    the run that did."""

    kind: ClassVar[str] = "queue.closed.v1"

    at: int
    why: ClosedWhy
    text: str
    by: Author | None = None
    run: str = ""


class QueueOpened(msgspec.Struct, frozen=True, kw_only=True):
    """A person has looked, and opened the queue of a robot again."""

    kind: ClassVar[str] = "queue.opened.v1"

    at: int
    author: Author


Wait: TypeAlias = Literal["closed", "run", "stop", "behind"]


class Waiting(msgspec.Struct, frozen=True):
    """The reason why an entry waits for one robot: its queue is closed; a `run` goes on; something is
    being stopped there; it is behind so many others."""

    robot: str
    why: Wait
    run: str = ""
    behind: int = 0


def stream_of(entry: str) -> str:
    """Return the name of the stream of an entry."""
    return f"{_PREFIX}{entry}"


def stream_of_robot(robot: str) -> str:
    """Return the name of the stream of the queue of a robot."""
    return f"{_ROBOT_PREFIX}{robot}"


def entry_id(request_id: str) -> str:
    """Return the id of the entry that the start with this request id makes."""
    return hashlib.sha256(f"queue {request_id}".encode()).hexdigest()[:22]


def request_of(entry: str) -> str:
    """Return the request id of the one start of an entry. The runs of a start on several robots have it
    with their robot behind it."""
    return f"{_PREFIX}{entry}"


def told(closed: QueueClosed, *, whole: bool = False) -> str:
    """Return why a queue is closed. Without `whole` it leaves out the details of a run or of a refused
    start, which may speak of a graph that the reader may not see."""
    if not whole and closed.why == "refused":
        return "A start of it was refused."
    if not whole and closed.why == "lost" and closed.run:
        return "A run on it was lost."
    return closed.text


def closing_of(closed: QueueClosed) -> str:
    """Return the name of the closing of a queue, by which a person says which one they saw."""
    return str(closed.at)


def kept_in(events: Iterable[Event]) -> StartRequest:
    """Return the start of an entry. Raise Unavailable if it is not among these events, or damaged."""
    kept = next((each.body for each in events if each.kind == QueueStartKept.kind), b"")
    try:
        return start_of(msgspec.json.decode(kept, type=QueueStartKept).start)
    except msgspec.DecodeError as damaged:
        raise Unavailable(
            "This cannot be started, remove it: its start cannot be read."
        ) from damaged


def order_of(request: QueueRequest) -> str:
    """Return the hash of all that an entry orders."""
    more = msgspec.json.encode(request.robots) if request.engines else b""
    return hashlib.sha256(ordered_in(request.start) + b"%d" % request.by_itself + more).hexdigest()


def require_queueable(request: QueueRequest) -> None:
    """Raise BadInput for a start that cannot wait."""
    start = request.start
    if start.drill or start.start_from is not None:
        where: dict[str, object] = {"path": "/start/drill" if start.drill else "/start/from"}
        text = "A Stop drill, and a start that takes outcomes of an earlier run, cannot wait."
        raise BadInput(text, where=where)
    require_form(start)
    if start.watching:
        text = "A person says that they watch when it starts, not when it is put into the queue."
        raise BadInput(text, where={"path": "/start/watching"})
    if request.engines:
        names = set(request.engines)
        if start.engine not in names or not names.isdisjoint({SIMULATOR, CONDUCTED}):
            text = "A start on several robots names robots only, that of the start among them."
            raise BadInput(text, where={"path": "/engines"})
    if request.by_itself and (request.robots or start.behaviours):
        text = "A person starts whatever may move something: by itself a start goes in the simulator alone."
        raise BadInput(text, where={"path": "/by_itself"})


def require_as_asked(entered: QueueEntered, start: StartRequest) -> None:
    """Raise Conflict unless the stored `start` of an entry may wait, and is for its robots: an earlier
    version took others, too."""
    request = QueueRequest(start=start, by_itself=entered.by_itself, engines=entered.engines)
    try:
        require_queueable(request)
    except BadInput as why:
        raise Conflict(f"This cannot be started, remove it: {why.detail}") from why
    if request.robots != entered.robots:
        raise Conflict("This cannot be started, remove it: its start is for other robots.")


def entered_of(
    request: QueueRequest, author: Author, at: int, name: str, seen: Looked, *, unsighted: bool
) -> QueueEntered:
    """Return the event that puts a start there. `name`: of its graph; `seen`: the look of its person."""
    start = request.start
    return QueueEntered(
        at=at,
        entry=entry_id(start.request_id),
        request_id=start.request_id,
        order=order_of(request),
        author=author,
        graph=start.graph,
        graph_name=name,
        version=start.version,
        digest=start.digest,
        engine=start.engine,
        robots=request.robots,
        seen=seen,
        engines=request.each_whole,
        values=start.values,
        by_itself=request.by_itself,
        inside=graphs_inside(start),
        unsighted=unsighted,
    )


def waits_of(
    entries: Iterable[Sequence[str]],
    closed: Collection[str],
    busy: Mapping[str, Sequence[Waiting]],
) -> Iterator[tuple[Waiting, ...]]:
    """Yield why each entry waits, nothing at its turn: when it is the first for all of its robots, and
    these are free. `entries`: the queues of each, in the one order that all queues have, so that no two
    wait for each other; `closed`: the queues that are, `busy`: why a robot is not free. One that waits for
    a closed queue keeps nobody waiting."""
    ahead: Counter[str] = Counter()
    for names in entries:
        shut = [Waiting(name, "closed") for name in names if name in closed]
        waits = list(shut)
        for name in names:
            if not shut:
                if ahead[name]:
                    waits.append(Waiting(name, "behind", behind=ahead[name]))
                ahead[name] += 1
            waits += busy[name]
        yield tuple(waits)


def looked_of(looks: Sequence[Preflight], rules: Mapping[str, Rules]) -> Looked:
    """Return what has to stay as it is of a pre-flight. `rules`: of each robot of the start."""
    items: dict[str, dict[str, str]] = {
        each.engine: {name: item.verdict for name, item in _counted(each)} for each in looks
    }
    words = {name: msgspec.json.encode(each).decode() for name, each in rules.items()}
    return Looked(items, words, next((each.tree_digest for each in looks if each.tree_digest), ""))


def _counted(look: Preflight) -> Iterator[tuple[str, Item]]:
    """Yield the items of a pre-flight that have to stay as they are, each with a name of its own: its
    code, and a number from the second of that code on."""
    counts: Counter[str] = Counter()
    for item in look.items:
        if item.code not in _OF_THE_MOMENT:
            counts[item.code] += 1
            number = counts[item.code]
            yield item.code if number == 1 else f"{item.code} {number}", item


def digest_of(looked: Looked, looks: Sequence[Preflight], ready_at: int | None) -> str:
    """Return the digest by which a person says what they have looked at: it is another one when an item
    says something else, figures aside, as when what was unknown becomes bad, and at another turn.
    `looked`: what counts of `looks`; `ready_at`: since when it is the turn, µs UTC, None before."""
    said = [
        (look.engine, name, _FIGURE.sub("#", item.text), item.codes)
        for look in looks
        for name, item in _counted(look)
    ]
    text = msgspec.json.encode((looked, said, ready_at), order="deterministic")
    return hashlib.sha256(text).hexdigest()[:22]


def differences(seen: Looked, now: Looked, looks: Sequence[Preflight]) -> tuple[str, ...]:
    """Return a sentence for each thing that is no longer as it was `seen`: rules of a robot that have
    changed, and items that were better. `now`: the part of `looks` that counts."""
    found = [
        f"The rules of {robot} have changed."
        for robot, rules in now.rules.items()
        if seen.rules.get(robot) != rules
    ]
    if now.tree_digest and now.tree_digest != seen.tree_digest:
        found.append("A graph inside of it is another one.")
    for look in looks:
        known = seen.items.get(look.engine, {})
        for name, item in _counted(look):
            if _WORSE[item.verdict] > _WORSE.get(known.get(name, "passed"), 0):
                found.append(item.text)
    return tuple(dict.fromkeys(found))


def require_waitable(start: StartRequest, looks: Iterable[Preflight]) -> None:
    """Raise Conflict if a pre-flight finds something that no waiting mends."""
    _require_none(_blocking(start, looks, _OF_THE_MOMENT))


def require_openable(start: StartRequest, looks: Iterable[Preflight], robot: str) -> None:
    """Raise Conflict if a pre-flight finds something on a robot that keeps its queue closed."""
    of_robot = [each for each in looks if each.engine in {robot, CONDUCTED}]
    _require_none(_blocking(start, of_robot, _AT_THE_START))


def _blocking(start: StartRequest, looks: Iterable[Preflight], but: frozenset[str]) -> list[Item]:
    overridden = set(start.override.codes) if start.override is not None else set[str]()
    return [
        each
        for look in looks
        for each in look.items
        if each.verdict == "blocked"
        and each.code not in but
        and not (each.overridable and overridden.issuperset(each.codes))
    ]


def _require_none(blocked: Sequence[Item]) -> None:
    if blocked:
        text = " ".join(each.text for each in blocked[:3])
        raise Conflict(text, where={"path": "/start", "item": blocked[0].code})


def queue_names_of(robots: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the queues in which a start for these robots waits."""
    return tuple(robots) or (SIMULATOR,)


def named(robot: str) -> str:
    """Return the name of the robot of a queue in a sentence."""
    return "the simulator" if robot == SIMULATOR else robot
