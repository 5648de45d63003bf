"""A run: all that is known of it, as one frozen value. Times are microseconds UTC."""

from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.links.engine_process import EngineProcess
from action_assistant.runner.links.health import HealthNow
from action_assistant.runner.links.observations import ACTIVE, TERMINAL
from action_assistant.runner.runs.earlier import Earlier, StartFrom
from action_assistant.runner.runs.events import (
    AtRest,
    Author,
    End,
    Held,
    Led,
    Overridden,
    Override,
    PartOfRepeat,
    PieceOf,
    PieceRest,
)
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.question_events import ClosedWhy, PauseBegan, QuestionAsked
from action_assistant.runner.runs.visits import ActionRun, Message
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.kept_values import NOTHING_KEPT, KeptValues
from action_assistant.umrf.laps import Laps
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.start_values import StartValues

State: TypeAlias = Literal[
    "requested",
    "published",
    "running",
    "paused",
    "stopping",
    "unknown",
    "finished",
    "halted",
    "stopped",
    "error",
    "refused",
    "lost",
]
Result: TypeAlias = Literal["on_true", "on_false", "on_error", "on_stopped", "on_halted"]
Desired: TypeAlias = Literal["running", "paused", "stopped"]
#: States in which a run is over.
ENDED: Final[frozenset[State]] = frozenset(
    {"finished", "halted", "stopped", "error", "refused", "lost"}
)
_END_OF: Final[dict[str, End]] = {
    "FINISHED": "finished",
    "HALTED": "halted",
    "STOPPED": "stopped",
    "ERROR": "error",
}


class Alarm(msgspec.Struct, frozen=True):
    """A message that a person must see now."""

    code: str
    at: int
    text: str


class Intervention(msgspec.Struct, frozen=True, kw_only=True):
    """A command of a person to the run at `at`. `state`, `active`: what was known at that time, the
    state of the run and the actions that were seen running."""

    kind: Literal["stop", "pause", "resume", "modify"]
    at: int
    by: Author
    state: State
    active: tuple[str, ...] = ()


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """The result of a visit as a person stated it, where no answer has shown it. `visit`: its
    number, from 1."""

    visit: int
    by: Author
    at: int
    reason: str


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of a person to a question of a visit. `visit`: its number, from 1; `value`: as JSON, ""
    if the person could not answer, for a `reason`."""

    visit: int
    question: str
    by: Author
    at: int
    value: str = ""
    reason: str = ""


class Closed(msgspec.Struct, frozen=True, kw_only=True):
    """A question that can be answered no more. `by`: who has answered it, None if nobody has; `value`:
    that answer; `why`: else the reason; `at`: since when."""

    question: str
    node: str
    at: int
    by: Author | None = None
    value: str = ""
    why: ClosedWhy | None = None


class Press(msgspec.Struct, frozen=True):
    """An order of a person to a led run. `by`: the id of the person; `what`: the kind of order
    and its details, as `go_on_press` and `outcome_press` write them; "" stands for any."""

    by: str
    what: tuple[str, ...]

    def is_repeated_by(self, later: "Press") -> bool:
        """Return whether a later press of the same request id is the same order of the same person."""
        pairs = zip(self.what, later.what, strict=False)
        return self.by == later.by and all(new in {"", old} for old, new in pairs)


def go_on_press(by: Author, since: int) -> Press:
    """Return the record of a person's press of *Go on*, for a led run that was held at `since`
    (microseconds UTC)."""
    return Press(by.id, ("go on", str(since)))


def step_press(
    by: Author, since: int, action: str, until: str, over: tuple[str, ...] = ()
) -> Press:
    """Return the record of a person's press of *Step*, for a led run that was held at `since`
    (microseconds UTC). `action`: the one to begin; `until`: the one before which it waits again;
    `over`: the sub-graph after which it waits again."""
    return Press(by.id, ("step", str(since), action, until, "\n".join(over)))


def wait_press(by: Author) -> Press:
    """Return the record of a person's press of *Wait*."""
    return Press(by.id, ("wait",))


def outcome_press(by: Author, action: str, outcome: str, piece: str, reason: str) -> Press:
    """Return the press that gives the outcome of an action by word. `piece`: the id of its piece;
    `outcome`: as `Precondition`, such as "on_true"."""
    return Press(by.id, ("outcome", action, outcome, piece, reason))


def answer_press(by: Author, question: str, value: str) -> Press:
    """Return the press that answers a question, by its id. `value`: as JSON, "" for none."""
    return Press(by.id, ("answer", question, value))


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """The state of one run, folded from its events. Times are microseconds UTC."""

    id: str
    number: int
    request_id: str
    author: Author
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    simulated: bool
    requested_at: int
    override: Override | None = None
    despite: tuple[Overridden, ...] = ()
    group: str | None = None
    repeat: PartOfRepeat | None = None
    like: str | None = None
    behaviours: bool = False
    led: Led | None = None  # of a led run
    piece: PieceOf | None = None  # of a piece of one
    held: Held | None = None  # why a led run begins nothing further
    #: Of a held run: the actions that are ready to begin and wait, with their robots, by call.
    waits: dict[int, tuple[str, str]] = {}
    breakpoints: tuple[Breakpoint, ...] = ()  # at which a led run waits
    lead: Author | None = None  # who let it go on last, or was handed it; None: its author
    tree_digest: str | None = None  # of the graph together with those inside; None if unknown
    batons: tuple[str, ...] = ()  # the robots whose baton the author held at the start
    watching: tuple[str, ...] = ()  # the robots that the author said to watch
    drill: bool = False  # it was started for a Stop drill
    inside: tuple[str, ...] = ()  # the ids of further graphs whose rules say who may see it
    unsighted: bool = False  # as in its request
    values: StartValues = {}  # given at the start
    sent_digest: str = ""  # of the graph with them; "" if there are none
    beyond: bool = False  # they, or the part that is played, are not what the version says
    start_from: StartFrom | None = None  # where it begins, if not at the entry
    earlier: Earlier | None = None  # all that it takes for granted then
    limits: dict[str, tuple[Limit, ...]] = {}  # in force on its robots at its start, or last change
    pages: dict[str, PagePresence] = {}  # the rules about visible pages at its start
    health: dict[str, tuple[HealthNow, ...]] = {}  # as its robots reported it at its start
    #: Of a led run, by piece: those that may go on, and the newest one of each robot.
    rests: dict[str, PieceRest] = {}
    said: dict[str, tuple[Said, ...]] = {}  # by the action of a led run
    questions: dict[str, QuestionAsked] = {}  # that are open, by id
    closed: tuple[Closed, ...] = ()  # the newest questions that are not
    answers: dict[str, tuple[Answer, ...]] = {}  # the newest, by the action of a led run
    pauses: dict[int, PauseBegan] = {}  # for which the runner waits now, by call
    #: The newest presses of people on a led run that counted, by their request ids.
    pressed: dict[str, Press] = {}
    desired: Desired = "running"
    incarnation: str | None = None  # None: nothing has been sent, as far as is known
    process: EngineProcess | None = None  # of the engine, where it can be seen to end
    graph_state: str | None = None
    parts: dict[str, str] = {}  # running sub-graphs of this run, and their states
    actions: dict[str, ActionRun] = {}
    inner: dict[str, Laps] = {}  # which actions of graphs inside run once, by the graphs' own names
    needs: tuple[tuple[str, str, int], ...] = ()  # as `Laps.needs`
    #: The request time of the newest answer that showed a graph in its present state, by graph.
    looked: dict[str, int] = {}
    #: The graph was modified, or others set it going: its arrows rule nothing out any more.
    reshaped: bool = False
    failed: bool = False  # an action has failed, or may have in a sub-graph
    stoppable: bool = False  # an arrow or a person may have stopped an action
    kept: KeptValues = (
        NOTHING_KEPT  # of a piece: what its action gave, as the newest answer shows it
    )
    result: str | None = None
    started_at: int | None = None
    ended_at: int | None = None
    going_at: int = 0  # until this moment it was not over
    reopened_at: int = 0  # feedback, which may be old, said then that it was not over after all
    over_at: int | None = None  # when it was first seen that nothing of it moved any more
    end: End | None = None
    detail: str = ""
    unknown_since: int | None = None
    proof_at: int | None = None
    unconfirmed: str = ""  # why nothing that the engine says shows rest any more
    loading: str = ""  # which actions may still be loading although nothing moves, in words
    loading_since: int | None = None  # when that was noted first
    lost: str = ""  # why the engine does not hold it any more, without a proof of rest
    at_rest: AtRest | None = None
    moves_again_at: int | None = None  # it had ended, and was seen to move; until its next end
    stop_requested_at: int | None = None
    stopped_by: Author | None = None
    stops_sent: int = 0
    interventions: tuple[Intervention, ...] = ()  # the newest; of several stops only the first
    alarms: tuple[Alarm, ...] = ()
    log: tuple[Message, ...] = ()  # the newest lines of the engine

    @property
    def state(self) -> State:
        """The state of the run in one term (docs/glossary.md), derived from all other fields."""
        if self.end is not None:
            return self.end
        if self.lost:
            return "lost"
        if self.unknown_since is not None:
            return "unknown"
        if self.desired == "stopped" or self.graph_state == "STOPPING":
            return "stopping"
        if self.incarnation is None:
            return "requested"
        match self.graph_state:
            case None | "UNINITIALIZED" | "INITIALIZED":
                return "published"
            case "PAUSED":
                return "paused"
            case state if self.doubt and state in TERMINAL and not self.active:
                return "unknown"
            case _:  # also a graph that has finished while nodes still run (H12)
                return "running"

    @property
    def robots(self) -> tuple[str, ...]:
        """The names of the robots that the run occupies from its request until it is proven over."""
        if self.simulated:
            return ()
        if self.led is None:
            return (self.engine,)
        return tuple(sorted(set(self.led.players.values())))

    @property
    def wholes(self) -> set[str]:
        """The ids of what the run is a part of: a group, and a led run whose piece it is."""
        return {self.group or "", self.piece.run if self.piece is not None else ""} - {""}

    @property
    def doubt(self) -> str:
        """The reason why no answer of the engine can prove now that the run is at rest; "" if one
        can."""
        return self.unconfirmed or self.loading

    @property
    def ended_true(self) -> bool:
        """Return whether the run finished and nothing is known to have failed: robots report no results."""
        return self.end == "finished" and (
            self.result == "on_true" or (self.result is None and not self.failed)
        )

    @property
    def active(self) -> tuple[str, ...]:
        """The names of the actions that move or may move again."""
        return tuple(name for name, action in self.actions.items() if action.state in ACTIVE)

    @property
    def apparent_end(self) -> End | None:
        """The end that the last observations show, if nothing follows them; None while the run
        moves or has ended."""
        if self.end is not None or self.graph_state is None or self.active:
            return None
        if any(state in {"RUNNING", "STOPPING", "PAUSED"} for state in self.parts.values()):
            return None
        return _END_OF.get(self.graph_state)
