"""The steps of a led run, and the gate before them."""

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from functools import partial
from math import inf
from typing import Final, Protocol

import anyio
import msgspec

from action_assistant.errors import Conflict
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.led_calls import LedCourse
from action_assistant.runner.links.observations import ACTIVE
from action_assistant.runner.links.port import Answer, GraphOutline, Order
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import (
    Author,
    Held,
    PieceEnded,
    PieceOf,
    PieceRest,
    PieceSeen,
    Requested,
    RunEvent,
)
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun
from action_assistant.runner.start.piece_texts import PieceText
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.facts import SIMULATED, EngineFacts
from action_assistant.umrf.laps import Laps
from action_assistant.umrf.led_subgraphs import StatesInside, outcome_of_subgraph
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.pieces import outcome_of
from action_assistant.umrf.semantics import Call
from action_assistant.web.auth.caller import Origin, acting_for
from action_assistant.web.auth.identity import Identity

#: Facts of the engine that plays the whole graph: only a proof ends what a robot does.
CONDUCTED_FACTS: Final = msgspec.structs.replace(
    SIMULATED, synchronises=True, stop_timeout_ms=10**12
)


def leading_facts(*, is_simulated: bool) -> EngineFacts:
    """Return the facts of the engine that plays the whole graph of a led run. `is_simulated`: no robot
    plays any of it, so that an action that ignores its stop ends as in the simulator."""
    if not is_simulated:
        return CONDUCTED_FACTS
    stop_timeout_ms = SIMULATED.stop_timeout_ms
    return msgspec.structs.replace(CONDUCTED_FACTS, stop_timeout_ms=stop_timeout_ms)


#: Bits of the number of a call in which the visits of an action inside of its sub-graph are counted.
_VISIT_BITS: Final = 20
#: Who stops an action in the name of the graph: an arrow of it, or its end.
GRAPH: Final = Author("graph", "the graph itself", "program")
#: Who stops a led run whose robot is lost, as the starter has chosen.
RUNNER: Final = Author("runner", "the runner", "program")


_TICK_S: Final = 0.5
_STALL_S: Final = 3.0  # for which nothing may have stood still before a piece leaves


class Tell(Protocol):
    """Shows and records an event of a run."""

    def __call__(self, event: RunEvent, author: str = "", /) -> None:
        """Show and record an event. `author`: the id of a person, or "" for the engine."""


class Leading(msgspec.Struct, frozen=True, kw_only=True):
    """The callbacks by which a conductor reaches the run that it leads (a run whose actions are
    carried out by several robots, step by step). `tell` shows an event to people and records it,
    `stored` waits until all events so far are in the journal, `stop` begins a Stop of the whole
    run, `rests` ends the whole run for the reason for which the given piece ended, where a person's
    statement or the end of its code showed that at rest and no answer did."""

    tell: "Tell"
    stored: Callable[[], Awaitable[None]]
    stop: Callable[[Author], None]
    rests: Callable[[Run], None]


class Word(msgspec.Struct, frozen=True, kw_only=True):
    """The outcome of an action as a person has stated it, because the states of the robot do not
    show it. `by`: the person; `piece`: the id of the run that carried the action out, "" for the
    newest one; `origin`: the connection by which the person stated it, None if it is not known;
    `request_id`: the id of the request, "" if it has none."""

    outcome: Precondition
    by: Author
    reason: str
    piece: str = ""
    origin: Origin | None = None
    request_id: str = ""


class LeftOpen(msgspec.Struct, frozen=True, kw_only=True):
    """A led run that an earlier process left unfinished. `order`: its start; `course`: the outcomes
    so far; `sent`: the highest number of a piece; `pieces`: by the number of each call without an
    outcome, the piece and the seq of its last event; `again`: pieces that moved again after their
    outcome, each with that seq; `calls`: all calls so far, with the full names of their actions; `breakpoints`:
    those that count; `played`: the calls among them that the simulator plays; `asked`: those without an
    outcome of which people were asked, or for which the runner waits, `pauses` until when (µs UTC);
    `states`: of the actions;
    `unproven`: the last
    piece that ended without a proof of rest by an answer, None if there is none."""

    order: Order
    course: LedCourse
    sent: int
    pieces: dict[int, tuple[Run, int]]
    again: tuple[tuple[Run, int], ...]
    states: dict[str, str]
    unproven: Run | None
    calls: dict[int, str] = {}
    played: dict[int, str] = {}
    breakpoints: tuple[Breakpoint, ...] = ()
    asked: dict[int, str] = {}
    pauses: dict[int, int] = {}


class Step:
    """One call of an action that a robot carries out, until the engine of the whole graph has been
    given its outcome. The run on the robot that carries it out is its piece."""

    def __init__(self, call: Call, engine: str) -> None:
        self.call = call
        self.engine = engine
        self.piece: OpenRun | None = None
        self.run: Run | None = None  # of its piece, as it is now
        self.shown: ActionRun | None = None  # as it was passed on last
        self.shown_inside: dict[str, ActionRun] = {}  # the actions inside, as they were passed on
        self.is_stopped = False  # the graph or a person wants it to end
        self.is_led = True  # its task goes on
        self.has_not_left = False  # its piece was refused before it left, or by its robot
        self.was_held_back = False  # by the gate, before it left
        self.lacks_output = False
        self.troubles: set[str] = set()  # those that were reported
        self.alarms: set[tuple[str, str]] = set()  # those of its piece that were passed on
        self.word: Word | None = None
        self.decided = anyio.Event()  # it is to end, or a person has given its outcome
        self.told = anyio.Event()  # its outcome is told to the run
        self.over = anyio.Event()  # its piece has ended
        self.rested = anyio.Event()  # set once `has_rested` is true
        self._waiting = anyio.CancelScope()  # while nothing was sent

    @property
    def node(self) -> str:
        """The full name of the action that this step calls."""
        return self.call.node

    @property
    def is_open(self) -> bool:
        """True while the piece of the step may move: it was handed over and is not proven at rest."""
        return self.run is not None and self.run.end is None

    @property
    def has_rested(self) -> bool:
        """True while the action of the step has ended and the graph of its piece goes on."""
        run = self.run
        if run is None or run.graph_state != "RUNNING":
            return False
        return run.actions[self.node].state == "FINISHED"

    @property
    def is_going(self) -> bool:
        """True while the piece of the step may move, or has ended and its outcome has not been
        passed on yet."""
        return self.is_open or (self.run is not None and self.is_led)

    def waiting(self) -> anyio.CancelScope:
        """Return a scope for the wait before the piece is sent; it is cancelled when the step is to
        end."""
        self._waiting = anyio.CancelScope()
        return self._waiting

    def end(self) -> None:
        """Let the step end; whatever waits to send its piece is cancelled."""
        self.is_stopped = True
        self.decided.set()
        self._waiting.cancel()

    def tell_end(self, tell: Tell, ended: PieceEnded) -> None:
        """Show and record the outcome of the step by `tell`. An outcome that a person gave is
        recorded as theirs, although another task carries it out."""
        if self.word is None:
            tell(ended)
        else:
            with acting_for(self.word.by.id, self.word.origin):
                tell(ended, self.word.by.id)
        self.told.set()

    def take_word(self, word: Word) -> None:
        """Take the outcome from a person. Raise Conflict unless the robot is proven or was seen at
        rest, its states tell no outcome, and no other word has come before."""
        piece = self.run.id if self.run is not None else ""
        if word.piece not in {"", piece}:
            raise Conflict(f"{self.node} has begun again since then.", where={"path": "/piece"})
        if self.is_open:
            raise Conflict(
                f"{self.node} on {self.engine} is not known to be at rest. Look at the robot, and "
                "confirm that first.",
                where={"path": "/action", "run": piece},
            )
        if "ended" not in self.troubles or self.word is not None:
            raise Conflict(
                f"The outcome of {self.node} is known already.", where={"path": "/action"}
            )
        self.word = word
        self.decided.set()

    def renew(self) -> None:
        """Forget a piece that was not sent, so that another one can be sent for the same step."""
        self.piece, self.run, self.shown, self.has_not_left = None, None, None, False
        self.was_held_back = False
        self.shown_inside = {}
        self.over, self.rested = anyio.Event(), anyio.Event()


class StepLimit(msgspec.Struct, frozen=True):
    """Limits how far a held run goes on: `only` one action begins, the one with the full name
    `action`, or the one that has waited longest for ""; or all begin that come before the action
    `until`, or that are inside of the opened sub-graph `over`. After that the run is held again."""

    only: bool = False
    action: str = ""
    until: str = ""
    over: tuple[str, ...] = ()


#: The limit of *Go on*.
UNLIMITED: Final = StepLimit()


class GoOn(msgspec.Struct, frozen=True):
    """The press by which the person `author` lets a held run go on, for `lead` from then on, as far as
    `limit` says. `request_id`: of the press, "" for none; `watching`: the robots that `lead` says to
    watch."""

    author: Author
    lead: Identity
    request_id: str
    watching: tuple[str, ...]
    limit: StepLimit


class Gate:
    """Decides whether a further piece of a led run may be sent to a robot. `held`: the event
    that says why none may for now, None if it is open; `is_final`: none ever will;
    `is_waiting`: none may for a moment, in which a change is stored."""

    def __init__(self, held: Held | None = None) -> None:
        self.held = held
        self.is_final = False
        self.is_waiting = False
        self._opened = anyio.Event()

    @property
    def is_open(self) -> bool:
        """True if a piece may be sent now: the gate is neither held, closed nor waiting."""
        return self.held is None and not self.is_final and not self.is_waiting

    def close(self) -> None:
        """Close the gate for good: from now on it lets no piece through. Nothing that waits is
        woken."""
        self.is_final = True

    def hold(self, held: Held) -> None:
        """Keep back all pieces that were not sent yet. `held`: the event that gives the time, the
        reason and the person."""
        self.held = held

    def release(self) -> None:
        """Let the pieces go on, unless the gate is closed for good."""
        self.held = None
        self._open()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let no piece begin until the end of the block."""
        self.is_waiting = True
        try:
            yield
        finally:
            self.is_waiting = False
            self._open()

    def _open(self) -> None:
        self._opened.set()
        self._opened = anyio.Event()

    async def wait(self) -> None:
        """Wait until the gate is open; for ever if it was closed for good."""
        while not self.is_open:
            await self._opened.wait()


class Silences:
    """Remembers of which robots it was told that they do not answer, with their last answer then."""

    def __init__(self, robots: Robots) -> None:
        self._robots = robots
        self._told: dict[str, Answer | None] = {}

    def is_told(self, name: str) -> bool:
        """Return whether this silence of a robot was told before; it is from now on."""
        robot = self._robots.link(name)
        answer = robot.answer if robot is not None else None
        is_told = name in self._told and self._told[name] is answer
        self._told[name] = answer
        return is_told


class StallWatch:
    """Notices that this process or computer stood still, or that its clock jumped. Observations
    from before such a jump are out of date."""

    def __init__(self, clock_us: ClockUs) -> None:
        self._clock_us = clock_us
        self._ticked = anyio.current_time()
        self._stood_still_at = -inf

    @property
    def stands_still(self) -> bool:
        """True if the process stood still until now, which `run` could not notice yet."""
        return anyio.current_time() - self._ticked > _STALL_S

    def stood_still_since(self, moment: float) -> bool:
        """Return whether the process stood still after `moment`, in seconds of the event loop: a
        timeout that began there says nothing about others."""
        return moment <= (anyio.current_time() if self.stands_still else self._stood_still_at)

    async def run(self, hold: Callable[[str], None]) -> None:
        """Call `hold` with the reason, in words, at each jump of time, until cancelled."""
        offset = self._clock_us() / 1e6 - anyio.current_time()
        while True:
            await anyio.sleep(_TICK_S)
            now = anyio.current_time()
            jumped = self._clock_us() / 1e6 - now - offset
            if now - self._ticked > _STALL_S:
                self._stood_still_at = now
                hold(f"The runner stood still for {now - self._ticked:.0f} s.")
            elif abs(jumped) > _STALL_S:
                hold(f"The clock of the runner's computer jumped by {jumped:.0f} s.")
                offset += jumped
            self._ticked = now


def seen_of(step: Step, action: ActionRun, state: str, at: int) -> PieceSeen:
    """Return the event that shows an action of a led run in a state. `step`: the call that
    the action belongs to; `action`: its visits and messages; `at`: µs UTC."""
    visit = action.visits[-1] if action.visits else None
    return PieceSeen(
        at=at,
        call=step.call.number,
        node=step.node,
        state=state,
        visit=visit,
        messages=tuple(each.text for each in action.messages),
    )


def rest_of(piece: Run, at: int, *, asks: bool = False) -> PieceRest:
    """Return the event that says whether, and by what, a piece is proven to be at rest (nothing of
    it moves). `at`: µs UTC; `asks`: the piece has ended without an outcome, and a person has to
    state one."""
    assert piece.piece is not None
    stops = piece.desired == "stopped" and piece.end is None
    since = piece.stop_requested_at or piece.requested_at
    known = PieceRest(
        at=at,
        piece=piece.id,
        node=piece.piece.node,
        engine=piece.engine,
        state="stopping" if stops else "going",
        since=since if stops else piece.requested_at,
        why=piece.loading if stops else "",
        stops=stops,
        asks=asks,
    )
    say = partial(msgspec.structs.replace, known)
    if piece.end is None:
        if piece.lost or piece.unconfirmed:
            return say(state="unproven", since=at, why=piece.lost or piece.unconfirmed)
        if piece.unknown_since is not None:
            return say(state="silent", since=piece.unknown_since, why="")
        return known
    since = piece.ended_at or at
    if piece.at_rest is not None:
        return say(state="seen", since=since, why=piece.at_rest.how, by=piece.at_rest.by)
    if piece.end == "refused":
        return say(state="unsent", since=since, why=piece.detail)
    if piece.end == "lost":
        return say(state="unproven", since=since, why=piece.detail)
    return say(state="proven", since=piece.proof_at or since, why="")


def seen_inside(step: Step, whole: str, at: int) -> list[PieceSeen]:
    """Return an event for each action inside the sub-graph of a step whose state has changed since
    this function was last called for the step. `whole`: the name of the graph of the led run, with
    which the names of these actions begin; `at`: the time of the events in µs UTC. The step may
    visit an inner action several times: `call` of an event is the number of the step's call,
    shifted left by 20 bits, plus the number of the visit."""
    run = step.run
    if run is None:
        return []
    events: list[PieceSeen] = []
    for name, action in run.actions.items():
        inside = name.removeprefix(f"{run.graph_name}__")
        if inside == name or "/" not in name or step.shown_inside.get(name) is action:
            continue
        step.shown_inside[name] = action
        unseen = run.end is not None and action.state in ACTIVE
        events.append(
            PieceSeen(
                at=at,
                call=(step.call.number << _VISIT_BITS) + action.older + len(action.visits),
                node=f"{whole}__{inside}",
                state="ERROR" if unseen else action.state,
                visit=action.visits[-1] if action.visits else None,
                messages=tuple(each.text for each in action.messages),
            )
        )
    return events


def outcome_shown(run: Run, text: PieceText) -> Precondition | None:
    """Return the outcome of a piece by the last states of its run; None if they do not show it.
    `text`: the graph that was sent as the piece."""
    states = run.graph_state, run.actions[text.action.full_name].state
    if not text.inside:
        return outcome_of(*states)
    inside = {name: each.state for name, each in run.actions.items() if "/" in name}
    seen = StatesInside(run.parts, inside)
    return outcome_of_subgraph(run.graph_name, text.action, states, seen, text.inside)


def order_of(first: Requested) -> Order:
    """Return the order that starts the whole graph of a led run. `first`: the first event of
    that run."""
    graph = GraphOutline(first.graph_name, first.actions)
    inside = tuple(each.umrf for each in first.subgraphs)
    return Order(run=first.run, graph=graph, umrf=first.umrf, inside=inside)


def piece_to_send(
    first: Requested, step: Step, piece: str, text: PieceText, umrf: str, at: int
) -> tuple[Requested, Order]:
    """Return the event that stores the piece of a step as a run, and the order that is sent to its
    robot. `first`: the first event of the whole run; `piece`: the id of the new run; `text`: the
    piece as prepared; `umrf`: its UMRF text with the values of inputs filled in; `at`: µs UTC."""
    name = text.name(first.graph_name, piece)
    actions = {step.node: first.actions[step.node]}
    requested = Requested(
        at=at,
        run=piece,
        number=first.number,
        request_id=f"{first.request_id}/{piece}",
        author=first.author,
        graph=first.graph,
        graph_name=name,
        version=first.version,
        digest=first.digest,
        engine=step.engine,
        simulated=False,
        actions=actions,
        umrf=umrf,
        laps=Laps(once=(step.node,)),
        inner_laps={
            name: first.inner_laps[name] for name in text.inside if name in first.inner_laps
        },
        piece=PieceOf(run=first.run, call=step.call.number, node=step.node),
    )
    graph = GraphOutline(name, actions)
    inside = tuple(each.umrf for each in first.subgraphs if each.name in text.inside)
    order = Order(run=piece, graph=graph, umrf=umrf, targets=(step.engine,), inside=inside)
    return requested, order


class RestNews:
    """Reports whether, and by what, each piece of a run is proven to be at rest, at each change."""

    def __init__(self, tell: Callable[[PieceRest], None], clock_us: ClockUs) -> None:
        self._tell = tell
        self._clock_us = clock_us
        self._told: dict[str, PieceRest] = {}  # by piece

    def show(self, piece: Run, *, asks: bool = False) -> None:
        """Report whether, and by what, a piece is proven to be at rest, if this has changed
        since the last report. `asks`: the piece has ended without an outcome, and a person is asked
        for the outcome. Later calls report that question too, until the piece moves again."""
        known = self._told.get(piece.id)
        asks = asks or (piece.end is not None and known is not None and known.asks)
        now = rest_of(piece, self._clock_us(), asks=asks)
        if known is None or _words_of(known) != _words_of(now):
            self._told[piece.id] = now
            self._tell(now)


def _words_of(rest: PieceRest) -> tuple[str, str, bool, bool]:
    return rest.state, rest.why, rest.stops, rest.asks
