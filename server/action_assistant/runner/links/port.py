"""The port between the runner and an engine: commands without answers, one query (`get`), and reports.

A `Link` is the connection to one engine; a `Reach` makes links to robots. When a command returns, its message
has left; that says nothing about whether the engine obeyed. An implementation keeps messages on one topic as
far apart as the engine needs (the runner may call `stop` for several graphs at once) and never repeats a
start. `at` is microseconds UTC.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Annotated, Any, Final, Literal, Protocol, TypeAlias

import msgspec

from action_assistant.runner.links.engine_process import EngineProcess
from action_assistant.runner.links.hardware_stop import HardwareStop, StopSignal
from action_assistant.runner.links.health import HealthCheck, HealthSignal
from action_assistant.runner.links.observations import Exact, LogLevel, Snapshot
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import Graph, Precondition
from action_assistant.umrf.semantics import Call

#: The engine that is always there.
SIMULATOR: Final = "simulator"
#: The engine of a run that the runner leads: it plays the whole graph, and robots its actions.
CONDUCTED: Final = "conducted"
_NAMED: Final = 3


EngineState: TypeAlias = Literal["answering", "busy", "gone", "restarted"]
Command: TypeAlias = Literal["start", "stop", "pause", "resume", "modify"]
#: The version of `temoto_msgs` that the peer uses. Messages are exchanged with `current` only.
Generation: TypeAlias = Literal["current", "older", "unknown"]


class NotSent(Exception):
    """The message of a command has certainly not left; the text says why."""


class EngineRefused(Exception):
    """The engine has refused a command; the text is the engine's own."""


class NoAnswer(Exception):
    """The engine did not answer a get in time, or cannot; the text gives the known reason."""


class GraphOutline(msgspec.Struct, frozen=True):
    """The part of a graph that the runner uses itself: its name, and the key of each action by full name."""

    name: str
    actions: dict[str, str]


def graph_outline(graph: Graph | GraphOutline) -> GraphOutline:
    """Return the name of a graph and the keys of its actions, by full name, without undrawn
    (missing) actions. A GraphOutline is returned unchanged."""
    if isinstance(graph, GraphOutline):
        return graph
    named = {each.full_name: each.key for each in graph.actions if not each.missing}
    return GraphOutline(graph.name, named)


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """One start of a graph. `umrf`: its text with the id of the run; `graph`: the graph or its
    outline. `targets`: the names of the engines that should run it; `inside`: the texts of all
    its sub-graphs, for an engine without an index."""

    run: str
    graph: Graph | GraphOutline
    umrf: str
    targets: tuple[str, ...] = ()
    inside: tuple[str, ...] = ()


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of an engine to one get: every graph that it holds, also ended ones.

    `asked_at` and `at`: microseconds UTC; `incarnation` changes when the engine is restarted.
    `texts`: the graphs as the engine wrote them, by running name. `known_actions`, `known_graphs`:
    the UMRF texts of its index.
    """

    asked_at: int
    at: int
    incarnation: str
    graphs: tuple[Snapshot, ...]
    texts: dict[str, str] = {}
    known_actions: tuple[str, ...] = ()
    known_graphs: tuple[str, ...] = ()


class Standing(msgspec.Struct, frozen=True, kw_only=True):
    """The present condition of an engine, as far as it is known without asking it. `servers`: how
    many answer on the path of its get; with exactly one, answers are a proof. `newcomers`: names of
    nodes that receive starts and may be a second engine, which does not serve its get yet.
    `listeners`: matched subscriptions by command (`start`, `stop` …). `others`: other publishers of
    starts. `actor`: the name in its feedback, "" before any. `process`: the engine's, if on this
    computer. `indexes`: it reads its folders again while it runs, so that asking it then may end it
    (H15); None if that is not known. `incarnation` changes when it is restarted. `ids_unknown`: the
    ids that the middleware gives to endpoints do not show which process they belong to. `settled`:
    discovery has had its time, so that an engine that it does not show is not there."""

    state: EngineState
    why: str = ""
    incarnation: str = ""
    generation: Generation = "unknown"
    servers: int = 0
    listeners: dict[str, int] = {}
    others: int = 0
    actor: str = ""
    process: EngineProcess | None = None
    newcomers: tuple[str, ...] = ()
    indexes: bool | None = None
    ids_unknown: bool = False
    settled: bool = False

    @property
    def doubt(self) -> str:
        """Return why an answer of this engine proves nothing, as a clause; "" when an answer is a
        proof."""
        if self.ids_unknown:
            return "the middleware does not show which process an answer comes from"
        if self.servers != 1:
            return f"{self.servers or 'no'} engines are seen on the path of its answers"
        if not self.newcomers:
            return ""
        is_one = len(self.newcomers) == 1
        return (
            f"{', '.join(self.newcomers[:_NAMED])} {'hears starts and does' if is_one else 'hear starts and do'} "
            f"not answer gets, so that {'it' if is_one else 'one of them'} may be a second engine that is "
            "coming up"
        )


class Transitions(msgspec.Struct, frozen=True, kw_only=True):
    """Exact changes of one run, oldest first, which only the simulator reports."""

    run: str
    changes: tuple[Exact, ...]


class Feedback(msgspec.Struct, frozen=True, kw_only=True):
    """Snapshots that the engine sent unasked, oldest first. It never sends one for each state, so
    some states are missing."""

    actor: str
    snapshots: tuple[Snapshot, ...]


class EngineLog(msgspec.Struct, frozen=True, kw_only=True):
    """A line of the engine's log, for people to read; it proves nothing. `level`: "" if unknown."""

    at: int
    text: str
    graph: str | None = None
    level: LogLevel = ""


class EngineChanged(msgspec.Struct, frozen=True, kw_only=True):
    """A report that the engine appeared, disappeared, or was replaced. `incarnation`: the id of its
    present life, "" if unknown; `why` is for people."""

    at: int
    state: EngineState
    incarnation: str = ""
    why: str = ""


class ForeignCommand(msgspec.Struct, frozen=True, kw_only=True):
    """A command to this engine that another program has published. `umrf`: the graph text in it, ""
    for none; `sender` distinguishes publishers."""

    at: int
    command: Command
    graph: str
    umrf: str = ""
    targets: tuple[str, ...] = ()
    sender: str = ""


class CallBegan(msgspec.Struct, frozen=True, kw_only=True):
    """The engine of a led run has come to an action, which begins when the conductor says so."""

    call: Call


class CallStopped(msgspec.Struct, frozen=True, kw_only=True):
    """The engine of a led run wants the call with this number to end."""

    number: int


class CallPlayed(msgspec.Struct, frozen=True, kw_only=True):
    """The engine of a led run has itself played the call with this number to its end. `outputs`: its
    values by flat name; `is_past`: an earlier engine had done so before."""

    number: int
    outcome: Precondition
    outputs: dict[str, Any]
    is_past: bool = False


Report: TypeAlias = (
    Transitions
    | Feedback
    | EngineLog
    | EngineChanged
    | ForeignCommand
    | CallBegan
    | CallStopped
    | CallPlayed
)


#: Is called right before a message leaves. It may raise NotSent, which holds the message back.
Leaves: TypeAlias = Callable[[], None]


def unwatched() -> None:
    """Do nothing: the default for `leaves`, for callers that need not know when a message leaves."""


class Link(Protocol):
    """The connection to one engine, as the runner uses it."""

    @property
    def simulated(self) -> bool:
        """True for an engine whose actions move nothing in the world."""
        ...

    @property
    def pauses(self) -> bool:
        """True for an engine on which pausing is safe."""
        ...

    @property
    def standing(self) -> Standing:
        """The present condition of the engine; every change of its state is also reported to
        listeners."""
        ...

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Publish one start message for the graph in `order`. `leaves` is called right before the
        message leaves, on a robot with no wait in between: a start that is cancelled before that
        call has certainly not left, and if `leaves` raises NotSent, the message is not sent. Raise
        NotSent if the message has certainly not left, EngineRefused if the engine refuses the
        start."""
        ...

    async def stop(self, graph_name: str) -> None:
        """Publish one stop message for the graph of this name. Do not wait for its effect. Raise
        NotSent if it could not be sent."""
        ...

    async def pause(self, graph_name: str) -> None:
        """Publish one pause message for the graph of this name. Do not wait for its effect. Raise
        NotSent if it could not be sent."""
        ...

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one resume message for the graph of this name. `continue_from` is the full name
        of an action that is started when the graph goes on, "" for none; `leaves`: as for a start.
        Raise NotSent if the message could not be sent."""
        ...

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one modify message: the order's graph takes the place of the running graph of the
        same name. `continue_from`: the full name of an action that is started when the graph goes
        on, "" for none; `leaves`: as for a start. Raise NotSent if the message could not be sent,
        EngineRefused if the engine refuses the change."""
        ...

    async def get(self) -> Answer:
        """Ask the engine for all graphs that it holds. The call has no timeout of its own. Raise
        NoAnswer if the engine cannot answer."""
        ...

    async def run(self) -> None:
        """Keep the link alive until cancelled. The link hears and answers only while this method
        runs."""
        ...

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` is called with every report of the engine, on the
        event loop and in order: a report that came before an answer is passed on before `get`
        returns."""
        ...

    async def aclose(self) -> None:
        """Close the link. A real engine goes on; a simulated one ends."""
        ...


class Registration(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The data by which a robot is reached. `name` is the wake word that its engine answers to; an empty `rmw`
    means the middleware of this process. `led`: its owner allows runs that the runner leads step by
    step."""

    name: str
    domain: Annotated[int, msgspec.Meta(ge=0, le=232)] = 0
    rmw: str = ""
    get_service: str = "umrf_graph_get"
    profile: dict[str, object] = {}
    led: bool = False


class Candidate(msgspec.Struct, frozen=True, kw_only=True):
    """An engine that discovery shows. `actor`: its name, "" until its feedback was received, since
    an engine without a running graph does not send its name; a person has to know it then."""

    domain: int
    rmw: str
    get_service: str
    servers: int = 1
    actor: str = ""
    generation: Generation = "unknown"
    problem: str = ""


class Sighting(msgspec.Struct, frozen=True):
    """The engines that are seen now. `left_s`: seconds during which discovery may still find
    others; 0 when it is complete."""

    engines: tuple[Candidate, ...]
    left_s: float


class Reach(Protocol):
    """Makes links to robots, and owns what the links share; one per process."""

    @property
    def rmw(self) -> str:
        """The name of the middleware of this process; robots on another one cannot be reached."""
        ...

    def link(self, registration: Registration, facts: EngineFacts) -> Link:
        """Return a link to a registered robot, whose engine build is described by `facts`. The call
        never waits and never fails: for a robot that cannot be reached, the link refuses every
        command with the reason. The link receives reports and answers only while its `run` method
        runs."""
        ...

    async def stop_signal(
        self,
        registration: Registration,
        facts: EngineFacts,
        rule: HardwareStop,
        changed: Callable[[], None],
    ) -> StopSignal:
        """Listen to the hardware stop of a robot from now on. `changed` is called after a message that
        says another thing than the one before it. Raise RuntimeError if that is not possible."""
        ...

    async def health_signal(
        self, registration: Registration, facts: EngineFacts, check: HealthCheck
    ) -> HealthSignal:
        """Listen to something of a robot's health from now on. Raise RuntimeError if that is not
        possible."""
        ...

    async def sighting(self) -> Sighting:
        """Return the engines that discovery shows now, on the domain of this process's environment
        and on the domains of all links. The call may join the domain, but does not wait for further
        engines to appear. Raise RuntimeError if the domain cannot be joined."""
        ...

    async def candidates(self) -> tuple[Candidate, ...]:
        """Return the engines that discovery shows once it has had its time; the call waits for
        that, at first some seconds. Raise RuntimeError if the domain cannot be joined."""
        ...

    async def aclose(self) -> None:
        """Leave all domains. The caller has to close all links before."""
        ...
