"""The order of a start: its claim to the rules of its robots, and the whole of what a second person says
yes to, as a digest and in words. Pure."""

import hashlib
import json
import math
import re
from collections.abc import Callable, Collection, Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final, TypeAlias

import msgspec
import rfc8785

from action_assistant.errors import BadInput
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.start.admission import GroupRequest, Prepared, StartRequest, Watching
from action_assistant.safe_text import hold_names
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.codes import CODES
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.limits import Limit, Limits
from action_assistant.umrf.start_values import StartValues, Value


def watched_in(watching: Watching, robots: Collection[str]) -> tuple[str, ...]:
    """Return the robots that a person watches, sorted. Raise BadInput for one that is not in
    `robots`."""
    for name in watching:
        if name not in robots:
            where: dict[str, object] = {"path": pointer("watching", name)}
            raise BadInput(f"Nothing of this moves {name}.", where=where)
    return tuple(sorted(name for name, is_watched in watching.items() if is_watched))


def claim_of(request: StartRequest, ready: Prepared | None) -> Claim:
    """Return what a start brings to the rules of robots. `ready`: None for a graph that is refused
    anyway."""
    return Claim(
        digest="" if ready is None else ready.tree_digest,
        watching=frozenset(name for name, is_watched in request.watching.items() if is_watched),
        is_drill=request.drill,
        beyond=ready is not None and ready.beyond,
        limits=None if ready is None else ready.limits,
        over=() if ready is None else ready.over,
        is_led=request.engine == CONDUCTED,
        is_start=True,
    )


class InQueue(msgspec.Struct, frozen=True):
    """A start that is carried out once, as this entry of the queue, at the turn that came at `ready_at`, µs UTC."""

    entry: str
    ready_at: int


class InRepeat(msgspec.Struct, frozen=True, kw_only=True):
    """A start that is carried out once for each cell of this repeat, until a doubt. `closings`: how often it was
    closed; `since`: when the newest doubt was seen, also while it was closed, µs UTC; `values`: of all
    cells; `grid`: action, input and values in turn; `times`, `seed`: as in `RepeatRequest`."""

    repeat: str
    closings: int
    since: int
    times: int
    grid: tuple[tuple[str, str, tuple[Value, ...]], ...]
    seed: int | None
    values: StartValues


#: How often a start is carried out; None: whenever a person starts exactly this.
Often: TypeAlias = InQueue | InRepeat | None


class OrderLine(msgspec.Struct, frozen=True):
    """A part of an order in words. `what`: its name, as "Limit"; `text`: what it is."""

    what: str
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Ordered(msgspec.Struct, frozen=True):
    """The order to which a second person says yes: the version by its tree digest, and the other parts
    of the order by name."""

    tree_digest: str
    parts: dict[str, Any]

    @property
    def digest(self) -> str:
        """The digest of the order. That of a start with nothing besides its graph is the tree digest."""
        if not self.parts:
            return self.tree_digest
        return hashlib.sha256(rfc8785.dumps([self.tree_digest, self.parts])).hexdigest()

    @property
    def approving(self) -> tuple[str, ...]:
        """The digests to which a yes covers this order: its own, and for an entry of the queue that of
        each start of exactly this. A repeat has no other."""
        whole = {name: part for name, part in self.parts.items() if name != "queue"}
        return tuple(dict.fromkeys([self.digest, Ordered(self.tree_digest, whole).digest]))

    def going_on(self, action: str) -> "Ordered":
        """Return the order of a change of a running graph, after which it goes on from this action; "" where
        the engine goes on by itself."""
        if not action:
            return self
        return Ordered(self.tree_digest, self.parts | {"continue": action})

    @property
    def lines(self) -> tuple[OrderLine, ...]:
        """The order in words: two orders with other digests have other words."""
        parts = self.parts
        found = [OrderLine("Graph", f"the version with the digest {self.tree_digest}")]
        if "repeat" not in parts and "queue" not in parts:
            text = "each time that a person starts exactly this by itself; no repeat"
            found.append(OrderLine("How often", text))
        if "robots" not in parts and "together" not in parts:
            text = "handed over whole to one robot, whichever asks for a second person"
            found.append(OrderLine("Robots", text))
        for name in _WORDS:
            if name in parts:
                found += [OrderLine(what, text) for what, text in _WORDS[name](parts[name])]
        if "limits" not in parts:
            found.append(OrderLine("Limits", "none in force"))
        return tuple(found)


def ordered(
    request: StartRequest,
    tree_digest: str,
    codes: Collection[str],
    limits: Limits,
    often: Often = None,
    together: Collection[str] = (),
) -> Ordered:
    """Return the order of a start: the version (`tree_digest`), and where there are any, the values, the
    robots of a led run with what happens when one is lost and the script of what the simulator plays in
    it, the overridden `codes`, the `limits` in force on its robots, its breakpoints, that its sub-graphs
    are opened, where it begins (the record of an earlier run, which is over, does not change), how
    often it is carried out, and the robots that get the whole graph `together`, if they are several."""
    more: dict[str, Any] = {}
    values = often.values if isinstance(often, InRepeat) else request.values
    if values:
        more["values"] = msgspec.to_builtins(values)
    if request.engine == CONDUCTED:
        more |= {"robots": request.robots, "lost": request.lost}
    if request.engine == CONDUCTED and SIMULATOR in request.robots.values() and request.script:
        more["script"] = bytes(request.script).decode()
    if request.people:
        more["people"] = request.people
    if codes:
        more["override"] = sorted(set(codes))
    if limits:
        more["limits"] = msgspec.to_builtins(limits)
    if request.start_from is not None:
        more["from"] = msgspec.to_builtins(request.start_from)
    if request.breakpoints:
        more["breakpoints"] = msgspec.to_builtins(request.breakpoints)
    if request.levels != "one_step":
        more["levels"] = request.levels
    if len(together) > 1:
        more["together"] = sorted(together)
    match often:
        case InQueue():
            more["queue"] = msgspec.to_builtins(often)
        case InRepeat():
            more["repeat"] = {
                name: each for name, each in msgspec.to_builtins(often).items() if name != "values"
            }
        case None:
            pass
    return Ordered(tree_digest, more)


_Words: TypeAlias = Iterator[tuple[str, str]]


#: Characters without a form of their own that Python calls printable: fillers, joiners, selectors, blanks.
_UNSEEN: Final = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)


def _text(value: object) -> str:
    """Return a value as JSON without characters that nobody sees: these turn, or imitate, other words."""
    return "".join(
        each if each.isprintable() and not _UNSEEN.match(each) else json.dumps(each)[1:-1]
        for each in as_json(value)
    )


def _of_values(values: dict[str, dict[str, Any]]) -> _Words:
    for action, given in sorted(values.items()):
        for name, value in sorted(given.items()):
            yield "Value", f"{_text(name)} of {_text(action)} = {_text(value)}"


def _of_robots(robots: dict[str, str]) -> _Words:
    for actor, robot in sorted(robots.items()):
        yield "Robot", f"{_text(actor) if actor else 'actions without a robot'}: {_text(robot)}"


def _of_people(people: dict[str, str]) -> _Words:
    for role, who in sorted(people.items()):
        answers = f"the person or group {_text(who)}" if who else "whoever may run it"
        yield "Answers", f"questions to {_text(role)}: {answers}"


def _of_override(codes: list[str]) -> _Words:
    for code in codes:
        meaning = CODES[code].meaning if code in CODES else ""
        yield "In spite of", f"{code}: {meaning}" if meaning else _text(code)


def _of_limits(limits: dict[str, list[dict[str, Any]]]) -> _Words:
    for robot, each in sorted(limits.items()):
        for limit in msgspec.convert(each, list[Limit]):
            of = f" of {_text(limit.action)}" if limit.action else ""
            least = "" if limit.least is None else f", at least {_text(limit.least)}"
            most = "" if limit.most is None else f", at most {_text(limit.most)}"
            yield "Limit", f"{_text(robot)}: {_text(limit.parameter)}{of}{least}{most}"


def _of_beginning(start: dict[str, Any]) -> _Words:
    at = start.get("at") or ()
    if not at:
        yield "Begins", f"where run {_text(start.get('run', ''))} ended"
    else:
        only = "only" if start.get("only") else "from here on"
        known = f", with the outcomes of run {_text(start['run'])}" if start.get("run") else ""
        yield "Begins", f"{only}: {_text(at)}{known}"
    for action, choice in sorted((start.get("choices") or {}).items()):
        yield "Was under way", f"{_text(action)}: {choice}"
    if start.get("reason"):
        yield "Known because", _text(start["reason"])


def _of_breakpoints(breakpoints: list[dict[str, Any]]) -> _Words:
    for each in msgspec.convert(breakpoints, list[Breakpoint]):
        parts = [f"{'after' if each.is_at_end else 'before'} {_text(each.action)}"]
        if each.inside:
            parts.append(f"of the sub-graph {_text(each.inside)}")
        if each.to:
            parts.append(f"towards {_text(each.to)}")
        if each.outcomes:
            parts.append(f"if it ended {' or '.join(each.outcomes)}")
        if each.visit:
            parts.append(f"at visit {each.visit}")
        if each.value is not None:
            value = each.value
            parts.append(f"if {_text(value.name)} {value.test} {_text(value.value)}")
        yield "Waits", " ".join(parts)


def _of_queue(queue: dict[str, Any]) -> _Words:
    since = _moment(queue["ready_at"])
    yield "How often", f"once, at the turn of its entry {queue['entry']} that came at {since}"


def _moment(at: int) -> str:
    return (datetime.fromtimestamp(0, UTC) + timedelta(microseconds=at)).isoformat()


def _of_repeat(repeat: dict[str, Any]) -> _Words:
    rounds = repeat["times"]
    runs = rounds * math.prod(len(values) for _, _, values in repeat["grid"])
    yield "How often", f"{runs} runs in {rounds} rounds, each by a press, until a doubt closes it"
    for action, name, values in repeat["grid"]:
        yield "In turn", f"{_text(name)} of {_text(action)} = each of {_text(values)}"
    if repeat["seed"] is not None:
        yield "Sequence", f"each round shuffled by the seed {repeat['seed']}"
    since = _moment(repeat["since"])
    closings = f"closed {repeat['closings']} times before this"
    yield "Repeat", f"{repeat['repeat']}, {closings}, without a doubt since {since}"


_LOST: Final[dict[str, str]] = {
    "stop": "the whole run is stopped",
    "wait": "the run waits for a person",
}
#: The words of each part of an order, in the order in which people read them.
_WORDS: Final[dict[str, Callable[[Any], _Words]]] = {
    "repeat": _of_repeat,
    "queue": _of_queue,
    "values": _of_values,
    "robots": _of_robots,
    "together": lambda names: iter(
        [("Robots", f"handed over whole to all of {_text(names)} at once")]
    ),
    "lost": lambda lost: iter([("If a robot is lost", _LOST[lost])]),
    "people": _of_people,
    "override": _of_override,
    "limits": _of_limits,
    "from": _of_beginning,
    "continue": lambda action: iter([("Goes on", f"from {_text(action)}, in a running graph")]),
    "breakpoints": _of_breakpoints,
    "levels": lambda _: iter([("Sub-graphs", "opened: each action inside is a step of its own")]),
    "script": lambda text: iter(
        [("Simulator", f"plays the script {hashlib.sha256(text.encode()).hexdigest()}")]
    ),
}


def overridden_in(request: StartRequest) -> tuple[str, ...]:
    """Return the codes of the problems that a start overrides."""
    return request.override.codes if request.override is not None else ()


def engines_of(request: StartRequest) -> tuple[str, ...]:
    """Return the names of the robots that a start is for, sorted; none for the simulator."""
    is_led = bool(request.robots or request.people)
    named = request.robots.values() if is_led else (request.engine,)
    return tuple(sorted({*named} - {SIMULATOR}))


def graphs_inside(request: StartRequest) -> tuple[str, ...]:
    """Return the ids of the graphs inside of what a start takes, as far as it names them."""
    named = tuple(each.graph for each in request.subgraphs if each.graph)
    return named + (request.sight.graphs if request.sight is not None else ())


def kept_for(request: StartRequest) -> tuple[str, ...]:
    """Return what one start at a time may have: its robots, by name, and the run that it continues, if
    any. No robot's name has a slash."""
    since = request.start_from
    continued = (f"run/{since.run}",) if since is not None and since.continues else ()
    return (*engines_of(request), *continued)


def require_plain(request: StartRequest | GroupRequest) -> None:
    """Raise BadInput if a start on a robot has fields that only the simulator understands."""
    if request.like is not None:
        raise BadInput("Only the simulator plays a robot.", where={"path": "/like"})
    if request.behaviours:
        raise BadInput("Only the simulator runs behaviours.", where={"path": "/behaviours"})
