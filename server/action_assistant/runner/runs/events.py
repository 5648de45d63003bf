"""The events of a run's stream: requests, messages sent, observations, proofs, ends.

Bodies are msgspec JSON; the kind stands in the journal's own column. Fields are only ever added,
with a default: streams of older versions must fold the same for ever. `at` is microseconds UTC,
taken when the thing happened, which may be before it was stored.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar, Final, Literal, Protocol, TypeAlias

import msgspec

from action_assistant.journal.events import BareEvent, Draft
from action_assistant.runner.links.engine_process import EngineProcess
from action_assistant.runner.links.health import HealthNow
from action_assistant.runner.links.observations import LogLevel, Seen
from action_assistant.runner.runs.author import Author as Author
from action_assistant.runner.runs.earlier import Before, Earlier, StartFrom
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.question_events import (
    AnswerRefused,
    PauseBegan,
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.visits import Visit
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.laps import Laps
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.questions import Asked
from action_assistant.umrf.start_values import StartValues
from action_assistant.web.auth.caller import stamped
from action_assistant.web.auth.graph_seals import Sight

End: TypeAlias = Literal["finished", "halted", "stopped", "error", "refused", "lost"]


class Override(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The codes of problems that a person overrides with a start, and the reason."""

    codes: tuple[str, ...]
    reason: str


class Overridden(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A problem that would have blocked a start, with the words of its pre-flight. `aid` (the key
    of the action) and `path` are its place in the graph that was sent."""

    code: str
    text: str
    aid: str | None = None
    path: str = ""


class RunSubgraph(msgspec.Struct, frozen=True, omit_defaults=True):
    """A graph inside of the started one, as it was sent along. `name`: of the actions that stand
    for it."""

    name: str
    version: str | None
    digest: str
    umrf: str
    graph: str | None = None


class Led(msgspec.Struct, frozen=True, kw_only=True):
    """The robots of a led run. `robots`: the engine that plays each actor, "" being the actor
    of actions that name none. `players`: the engine of each action, by full name. `lives`: the id
    of each engine's process when it was checked before the start. `lost`: what happens when a robot
    does not answer or its step fails: a Stop of everything, or a wait for a person. `together`: a
    person agreed that a robot may carry out two steps at once. `keeping`: the engines that have the
    helper package by which outputs can be read. `people`: who answers the questions of each actor;
    `asked`: the actions that people answer, or for which the runner waits, by full name."""

    robots: dict[str, str]
    players: dict[str, str]
    lives: dict[str, str] = {}
    lost: Literal["stop", "wait"] = "stop"
    together: bool = False
    keeping: tuple[str, ...] = ()
    people: dict[str, str] = {}
    asked: dict[str, Asked] = {}


class PieceOf(msgspec.Struct, frozen=True, kw_only=True):
    """The place of a piece in its led run: the id of that run, the number of the call, and
    the full name of the action."""

    run: str
    call: int
    node: str


class PartOfRepeat(msgspec.Struct, frozen=True):
    """The place of a run in a repeat: its id, and the number of the cell, from 1."""

    id: str
    cell: int


class Requested(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person asked for a start and it was accepted. Stored before anything is sent."""

    kind: ClassVar[str] = "run.requested.v1"

    at: int
    run: str
    number: int
    request_id: str
    author: Author
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    simulated: bool
    actions: dict[str, str]  # full name -> aid
    umrf: str  # as sent
    script: str = ""  # JSON text
    override: Override | None = None
    despite: tuple[Overridden, ...] = ()  # what was overridden
    group: str | None = None  # shared by runs that one request has started together
    like: str | None = None  # the robot whose engine the simulator played
    laps: Laps | None = None  # None: found in `umrf`
    inner_laps: dict[str, Laps] = {}  # of the graphs inside, by name
    behaviours: bool = False  # whether the simulator had Python behaviours
    subgraphs: tuple[RunSubgraph, ...] = ()  # all graphs inside, by value
    tree_digest: str | None = None  # of the graph together with them; None if unknown
    led: Led | None = None  # of a led run
    breakpoints: tuple[Breakpoint, ...] = ()  # where it waits
    piece: PieceOf | None = None  # of a piece, which is no run of its own for people
    batons: tuple[str, ...] = ()  # the robots whose baton the author held
    watching: tuple[str, ...] = ()  # the robots that the author said to watch
    drill: bool = False  # the start was for a Stop drill
    sight: Sight | None = None  # the rules of its graphs at the start, if the client sent them
    unsighted: bool = False  # there were rules, and it did not: only its author and owners see it
    values: StartValues = {}  # given at the start; `umrf` has them, the version does not
    sent_digest: str = ""  # of `umrf` with them; "" if there are none
    beyond: bool = False  # they, or the part that is played, are not what the version says
    start_from: StartFrom | None = None  # where it begins, if not at the entry
    earlier: Earlier | None = None  # all that it takes for granted then
    before: Before | None = None  # the course of the run that it continues
    #: The sub-graphs around each action, outermost first, where these are opened; else None.
    levels: dict[str, tuple[str, ...]] | None = None
    repeat: PartOfRepeat | None = None  # of which it is a cell
    limits: dict[str, tuple[Limit, ...]] = {}  # in force on its robots at the start
    pages: dict[str, PagePresence] = {}  # the rules about visible pages there
    health: dict[str, tuple[HealthNow, ...]] = {}  # as its robots reported it


class Published(msgspec.Struct, frozen=True, omit_defaults=True):
    """The start message was sent, once. `incarnation`: the id of the engine process that was to
    receive it; `process`: that process, if it is on the runner's computer."""

    kind: ClassVar[str] = "run.published.v1"

    at: int
    incarnation: str = ""
    process: EngineProcess | None = None


class Observed(msgspec.Struct, frozen=True, gc=False):
    """States, results or snapshots of the engine were seen, in this order."""

    kind: ClassVar[str] = "run.observed.v1"

    at: int
    seen: tuple[Seen, ...]


class PauseRequested(msgspec.Struct, frozen=True):
    """A person wants the run to pause."""

    kind: ClassVar[str] = "run.pause_requested.v1"

    at: int
    author: Author


class ResumeRequested(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person wants the run to go on. `watching`: the robots that they said to watch."""

    kind: ClassVar[str] = "run.resume_requested.v1"

    at: int
    author: Author
    watching: tuple[str, ...] = ()


class ModifyRequested(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person gave the run another version of its graph. Stored before it is sent. `watching`: the
    robots that they said to watch."""

    kind: ClassVar[str] = "run.modify_requested.v1"

    at: int
    author: Author
    version: str
    digest: str
    actions: dict[str, str]  # full name -> aid
    umrf: str  # as sent
    continue_from: str = ""
    watching: tuple[str, ...] = ()
    limits: dict[str, tuple[Limit, ...]] = {}  # in force on its robot then


class ModifyRefused(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The last change of the graph was not made: the version that ran before, repeated here, still
    runs. `actions`: all actions known at that time."""

    kind: ClassVar[str] = "run.modify_refused.v1"

    at: int
    version: str
    digest: str
    actions: dict[str, str | None]  # full name -> aid
    why: str = ""
    limits: dict[str, tuple[Limit, ...]] = {}  # to which that version was held


class StopRequested(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person wants the run stopped. This holds until the run has ended; nothing takes it back.
    `stop_id`: the id of the press, by which a repeat of it is recognised; "" if it has none."""

    kind: ClassVar[str] = "run.stop_requested.v1"

    at: int
    author: Author
    stop_id: str = ""


class StopSent(msgspec.Struct, frozen=True, omit_defaults=True):
    """A stop message has left, or (`failed`) could not."""

    kind: ClassVar[str] = "run.stop_sent.v1"

    at: int
    attempt: int
    failed: str = ""


class Proof(msgspec.Struct, frozen=True):
    """No node was running in the answer to a get that was sent after the stop. `hash`: the SHA-256
    of that answer."""

    kind: ClassVar[str] = "run.proof.v1"

    at: int
    asked_at: int
    hash: str


class Silent(msgspec.Struct, frozen=True, omit_defaults=True):
    """The engine answers no get; its state is unknown since `since`."""

    kind: ClassVar[str] = "run.silent.v1"

    at: int
    since: int
    why: str = ""


class Answered(msgspec.Struct, frozen=True):
    """The engine answers gets again, after a silence."""

    kind: ClassVar[str] = "run.answered.v1"

    at: int


class AlarmRaised(msgspec.Struct, frozen=True):
    """A person must know this now."""

    kind: ClassVar[str] = "run.alarm_raised.v1"

    at: int
    code: str
    text: str


class EngineSaid(msgspec.Struct, frozen=True, omit_defaults=True):
    """A line of the engine's own log about this run. It is evidence for a person and proves
    nothing. `level`: "" if unknown, as in events of earlier versions."""

    kind: ClassVar[str] = "run.engine_said.v1"

    at: int
    text: str
    level: LogLevel = ""


class Unconfirmed(msgspec.Struct, frozen=True, omit_defaults=True):
    """No answer of the engine can prove any more that the run is at rest. `why`: the reason.
    `lost`: the engine does not hold the run any more; else it holds actions that did not obey."""

    kind: ClassVar[str] = "run.unconfirmed.v1"

    at: int
    why: str
    lost: bool = False


class Loading(msgspec.Struct, frozen=True, omit_defaults=True):
    """No action of the run moves, but these may still be loading; `why` says it in words and is ""
    when loading is over. Actions are named by the running name of their graph and their full
    name."""

    kind: ClassVar[str] = "run.loading.v1"

    at: int
    why: str = ""
    actions: tuple[tuple[str, str], ...] = ()


class AtRest(msgspec.Struct, frozen=True):
    """The observation that ended a run where no answer of the engine proves that nothing moves.
    `by`: the person who saw it; None if the runner saw that the engine's process, or its last
    thread for the run, had ended. `how`: in words."""

    by: Author | None
    at: int
    how: str


class Ended(msgspec.Struct, frozen=True, omit_defaults=True):
    """The run is over, in this state; for `refused` and `lost` `detail` says why. `at_rest`: who
    saw that nothing moves, where no answer of the engine could prove it."""

    kind: ClassVar[str] = "run.ended.v1"

    at: int
    state: End
    result: str | None = None
    detail: str = ""
    at_rest: AtRest | None = None


class MovesAgain(msgspec.Struct, frozen=True):
    """The engine shows the run moving after its end: the run is open again, without that end.
    `text`: what moves, and how the run had ended."""

    kind: ClassVar[str] = "run.moves_again.v1"

    at: int
    text: str


class PieceBegan(msgspec.Struct, frozen=True, kw_only=True):
    """A piece of a led run is about to be sent to a robot. Stored before it is sent; its own
    stream, that of the run `piece`, says whether it left. A call whose piece certainly has not left
    may get another one."""

    kind: ClassVar[str] = "run.piece_began.v1"

    at: int
    call: int
    node: str
    engine: str
    piece: str


class PlayBegan(msgspec.Struct, frozen=True, kw_only=True):
    """The simulator plays a call of a led run from now on."""

    kind: ClassVar[str] = "run.play_began.v1"

    at: int
    call: int
    node: str


class PieceSeen(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The robot that plays an action of a led run shows it in another state. `visit`: its
    visit with the bounds that the observations of the robot allow; None before it was seen running
    or over. `messages`: its newest messages. `node`: its full name; of an action inside of a
    sub-graph, its name in a run on one robot, and `call` is another number for each of its visits."""

    kind: ClassVar[str] = "run.piece_seen.v1"

    at: int
    call: int
    node: str
    state: str
    visit: Visit | None = None
    messages: tuple[str, ...] = ()


class PieceRest(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The proof that a piece of a led run is at rest (nothing of it moves) has come further,
    or got lost. `state`: it goes on ("going"), gets Stops until rest is proven ("stopping"), its
    robot does not answer ("silent"), no answer can prove its rest any more ("unproven"), an answer
    has proven it ("proven"), a person or the runner has seen it ("seen"), or it never began
    ("unsent"). `since`: when that began; `why`: the reason, or how rest was seen; `stops`: a Stop
    is asked for; `asks`: the piece has ended without an outcome, which a person has to give."""

    kind: ClassVar[str] = "run.piece_rest.v1"

    at: int
    piece: str
    node: str
    engine: str
    state: Literal["going", "stopping", "silent", "unproven", "proven", "seen", "unsent"]
    since: int
    why: str = ""
    by: Author | None = None
    stops: bool = False
    asks: bool = False

    @property
    def rests(self) -> bool:
        """True once the piece is at rest, proven or seen, or never began."""
        return self.state in {"proven", "seen", "unsent"}


#: How the outcome of a call of a led run is known.
EndHow: TypeAlias = Literal["shape", "word", "unsent", "answer", "deadline", "time", "fault"]


class PieceEnded(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A call of a led run has its outcome. `how`: by the states of the piece in an answer
    that was asked for after its end ("shape"), by a person's statement ("word"), because nothing
    of it was ever sent ("unsent"), by the answer of a person who was asked ("answer") or the lack of one
    at the deadline ("deadline"), at the end of a wait ("time"), or since nobody could be asked
    ("fault"). `hash`: the SHA-256 of that answer. `outputs`: the values that
    the action gave, as JSON by flat name; `unset`: outputs that it did not set, or that nobody saw
    where a person gave the outcome; both empty where no answer can show them. `request_id`: the id
    of the person's request, "" if it has none."""

    kind: ClassVar[str] = "run.piece_ended.v1"

    at: int
    call: int
    node: str
    outcome: Precondition
    how: EndHow
    piece: str = ""
    hash: str = ""
    by: Author | None = None
    reason: str = ""
    outputs: dict[str, str] = {}
    unset: tuple[str, ...] = ()
    request_id: str = ""


#: The kinds of reasons for which the gate of a led run is held.
HeldHow: TypeAlias = Literal["trouble", "wait", "step", "breakpoint"]


class Held(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """No further piece of a led run begins until a person lets it go on. `by`: None where the
    runner itself holds it; `why`: the reason, as a sentence. `how`: because of a fault or a change of
    rights ("trouble"), since a person made it wait, after a step, or at a breakpoint. `node`: the action
    that was let through by the step, or before which it waits; `reason`, `request_id`: those of the
    person who made it wait."""

    kind: ClassVar[str] = "run.held.v1"

    at: int
    why: str
    by: Author | None = None
    how: HeldHow = "trouble"
    node: str = ""
    reason: str = ""
    request_id: str = ""


class BreakpointsSet(msgspec.Struct, frozen=True, kw_only=True):
    """A person set the breakpoints of a led run: these count from now on."""

    kind: ClassVar[str] = "run.breakpoints_set.v1"

    at: int
    author: Author
    breakpoints: tuple[Breakpoint, ...]


class PieceWaits(msgspec.Struct, frozen=True, kw_only=True):
    """A call of a led run is ready to begin, and waits before the held gate. It waits until its piece
    begins, or the call ends."""

    kind: ClassVar[str] = "run.piece_waits.v1"

    at: int
    call: int
    node: str
    engine: str


class Released(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person let a held run go on. `since`: when it was held; 0 in events of earlier versions;
    `request_id`: names the press, "" where the caller gave none. `watching`: the robots that they said
    to watch. `step`: the only action that may begin, after which the run is held again, "" for no such
    limit; `until`: the action before which it is held again, "" for none; `over`: it is held again before
    any action outside of this opened sub-graph."""

    kind: ClassVar[str] = "run.released.v1"

    at: int
    author: Author
    since: int = 0
    request_id: str = ""
    watching: tuple[str, ...] = ()
    step: str = ""
    until: str = ""
    over: tuple[str, ...] = ()


class HandedOver(msgspec.Struct, frozen=True, kw_only=True):
    """A person handed a led run over, with the batons of its robots: it goes on for `to`."""

    kind: ClassVar[str] = "run.handed_over.v1"

    at: int
    author: Author
    to: Author


class Unknown(msgspec.Struct, frozen=True):
    """An event of a kind that this version does not know. It is kept and skipped."""

    kind: ClassVar[str] = ""


RunEvent: TypeAlias = (
    Requested
    | Published
    | Observed
    | PauseRequested
    | ResumeRequested
    | ModifyRequested
    | ModifyRefused
    | StopRequested
    | StopSent
    | Proof
    | Silent
    | Answered
    | AlarmRaised
    | EngineSaid
    | Unconfirmed
    | Loading
    | Ended
    | MovesAgain
    | PieceBegan
    | PlayBegan
    | PieceSeen
    | PieceRest
    | PieceEnded
    | PieceWaits
    | BreakpointsSet
    | Held
    | Released
    | HandedOver
    | QuestionAsked
    | QuestionAnswered
    | QuestionClosed
    | AnswerRefused
    | PauseBegan
    | Unknown
)

# Made once: a decoder takes twice as long to build as a short body to decode.
_DECODERS: Final[Mapping[str, msgspec.json.Decoder[RunEvent]]] = {
    each.kind: msgspec.json.Decoder(each)
    for each in (
        Requested,
        Published,
        Observed,
        PauseRequested,
        ResumeRequested,
        ModifyRequested,
        ModifyRefused,
        StopRequested,
        StopSent,
        Proof,
        Silent,
        Answered,
        AlarmRaised,
        EngineSaid,
        Unconfirmed,
        Loading,
        Ended,
        MovesAgain,
        PieceBegan,
        PlayBegan,
        PieceSeen,
        PieceRest,
        PieceEnded,
        PieceWaits,
        BreakpointsSet,
        Held,
        Released,
        HandedOver,
        QuestionAsked,
        QuestionAnswered,
        QuestionClosed,
        AnswerRefused,
        PauseBegan,
    )
}


class StoredKind(Protocol):
    """An event whose body is JSON and whose kind stands beside it."""

    kind: ClassVar[str]


def draft_of(event: StoredKind, author: str = "") -> Draft:
    """Encode an event for the journal. `author` is the id of a person or the name of a robot, "" for
    the runner itself. The body holds the origin of a person by whose request the task works."""
    return Draft(event.kind, author, stamped(msgspec.json.encode(event), author))


def decode_all(usual: str, events: Iterable[BareEvent]) -> list[RunEvent]:
    """Decode stored events of one stream. `usual`: the kind of events that are stored without one.
    Raise msgspec.DecodeError if a body does not match its kind."""
    read = _DECODERS[usual].decode
    try:
        return [read(body) if kind is None else decode(kind, body) for body, kind, _ in events]
    except TypeError as error:
        raise msgspec.DecodeError(str(error)) from error


def decode(kind: str, body: bytes) -> RunEvent:
    """Decode the stored body of an event of this kind; return `Unknown` if this version does not
    know the kind. Raise msgspec.DecodeError if the body does not match its kind."""
    known = _DECODERS.get(kind)
    try:
        return Unknown() if known is None else known.decode(body)
    except TypeError as error:  # a damaged database may give out a number
        raise msgspec.DecodeError(str(error)) from error


#: Fields of events that are for programs, or too large to be read; people may search all other texts.
_NOT_SEARCHED: Final = frozenset({
    "actions", "address", "aid", "at", "before", "by", "earlier", "digest", "piece", "graph", "group", "hash", "health", "id", "incarnation", "inner_laps",
    "laps", "limits", "pages", "path", "process", "request_id", "run", "script", "stop_id", "subgraphs", "tree_digest", "type", "umrf",
    "version",
})  # fmt: skip


def said_in(event: RunEvent) -> Iterator[str]:
    """Yield the texts of an event that people may search for. An `Observed` event has none: the run
    that it is folded into has its messages."""
    if not isinstance(event, Observed):
        yield from _texts_in(msgspec.to_builtins(event))


def _texts_in(value: Any) -> Iterator[str]:
    match value:
        case str():
            yield value
        case dict():
            for name, each in value.items():
                if name not in _NOT_SEARCHED:
                    yield from _texts_in(each)
        case list() | tuple():
            for each in value:
                yield from _texts_in(each)
