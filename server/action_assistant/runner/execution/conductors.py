"""Opens led runs: new ones, and those that an earlier process left."""

import logging
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import AbstractAsyncContextManager, nullcontext
from functools import partial
from typing import Final
from weakref import WeakValueDictionary

import anyio
import msgspec

from action_assistant.errors import Conflict, OutcomeUnknown
from action_assistant.runner.execution.asked_steps import Given, OpenQuestion
from action_assistant.runner.execution.conducted_steps import (
    GoOn,
    Leading,
    LeftOpen,
    Word,
    leading_facts,
    order_of,
)
from action_assistant.runner.execution.conductor import Conductor
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.stored_course import stored_course
from action_assistant.runner.execution.unread_runs import UNREAD, UnreadRun
from action_assistant.runner.links.led_calls import LedCourse
from action_assistant.runner.links.port import Leaves, unwatched
from action_assistant.runner.links.simulator import LeadableLink, Simulator
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import (
    Author,
    MovesAgain,
    Requested,
    Silent,
)
from action_assistant.runner.runs.history import LeftRun, RunHistory, piece_number
from action_assistant.runner.runs.question_events import QuestionClosed
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start.idempotency import IdempotentStarts
from action_assistant.runner.start.piece_texts import PieceText, piece_texts
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.web.auth.identity import Identity

log: Final = logging.getLogger(__name__)

_RESTARTED: Final = "The runner was restarted while it led this run."
_BEFORE: Final = "Before that it was held: "
_STORED_S: Final = 5  # for which a person waits until the journal has an outcome by word


class Conductors:
    """Opens led runs, whose actions several robots carry out, and finds the conductor of each
    open one."""

    def __init__(
        self,
        robots: Robots,
        look: LedLook,
        runs: OpenRuns,
        history: RunHistory,
        simulator: Simulator,
        runtime: Runtime,
    ) -> None:
        self._robots = robots
        self._look = look
        self._runs = runs
        self._history = history
        self._simulator = simulator
        self._runtime = runtime
        self._claims = IdempotentStarts(runtime.journal, runtime.tasks, runtime.clock_us)
        self._open: WeakValueDictionary[str, Conductor] = WeakValueDictionary()
        #: Returns why a person whose page is missing may not let a run go on, by run and robot; "" if they
        #: may.
        self.why_missing: Callable[[str, str, Identity], str] | None = None
        runs.watch(self._see)

    def open(
        self,
        first: Requested,
        run: Run,
        texts: Mapping[str, PieceText],
        engine: LeadableLink,
        *,
        seq: int = 1,
        left: LeftOpen | None = None,
        lead: Identity | None = None,
        may_leave: Leaves = unwatched,
    ) -> OpenRun:
        """Open a stored led run, and return it. `first`: its first event; `seq`: the number
        of its last stored event; `texts`: its pieces by full name of their action; `engine` plays
        the whole graph; `left`: how far an earlier process led it, None for a new run;
        `lead`: for whom it is led; `may_leave`: as for `OpenRuns.open`."""
        conductor = Conductor(
            first,
            texts,
            engine,
            make_engine=lambda: self._engine_for(first),
            robots=self._robots,
            look=self._look,
            runs=self._runs,
            claims=self._claims,
            clock_us=self._runtime.clock_us,
            left=left,
            lead=lead,
        )
        opened = self._runs.open(
            run,
            conductor,
            owns_link=True,
            seq=seq,
            pressed=conductor.close,
            may_leave=may_leave,
        )
        if self.why_missing is not None:
            conductor.gate.why_missing = partial(self.why_missing, run.id)
        conductor.leads(_leading(opened))
        self._open[run.id] = conductor
        return opened

    async def take_up(self, run: Run, seq: int) -> None:
        """Continue a run that an earlier process left; `seq`: the number of its last stored event.
        Nothing new begins until a person lets the run go on, but what the robots still do is
        followed. Raise Unavailable if the journal cannot be read, msgspec.DecodeError or another
        Refused if its content cannot."""
        first = await self._history.requested(run.id)
        left = await _left_open(self._history, first, run)
        texts = await self._runtime.run_in_worker(piece_texts, first.umrf, first.subgraphs)
        opened = self.open(first, run, texts, self._engine_for(first), seq=seq, left=left)
        at = self._runtime.clock_us()
        for each in run.questions.values():
            closed = QuestionClosed(
                at=at, call=each.call, node=each.node, question=each.question, why="restarted"
            )
            opened.tell(closed)
        if run.desired != "stopped":
            before = run.held.why.removeprefix(f"{_RESTARTED} {_BEFORE}") if run.held else ""
            why = (
                f"{_RESTARTED} {_BEFORE}{before}" if before not in {"", _RESTARTED} else _RESTARTED
            )
            self._open[run.id].gate.hold_run(why)
        for piece, last in left.again:  # each reports itself to the conductor (`_see`) once opened
            link = self._robots.link(piece.engine)
            self._runs.drive(self._runs.open(piece, link, owns_link=False, seq=last))
        self._runs.drive(opened)

    async def follow_unread(self, run: Run, seq: int) -> None:
        """Follow the pieces of a run that an earlier process left, and stop them when Stop is
        pressed. The run itself cannot be continued, since some of its events cannot be read. `seq`:
        the number of its last event. Raise Unavailable if the journal cannot be read."""
        log.error("run %s: some of its events cannot be read; its pieces are followed", run.id)
        pieces, lacking = await self._history.pieces(run.id)
        link = UnreadRun(run, lacking, runs=self._runs, clock_us=self._runtime.clock_us)
        opened = self._runs.open(run, link, owns_link=True, seq=seq, pressed=link.close)
        link.leads(_leading(opened))
        at = self._runtime.clock_us()
        opened.alarm("led_unread", link.why)
        if run.unknown_since is None:
            opened.tell(Silent(at, at, link.why))
        for piece in pieces:
            link.follow(piece.run, piece.seq, self._robots, is_whole=piece.is_whole)
        self._runs.drive(opened)

    def follow_pieces(self, run: str, pieces: Iterable[LeftRun]) -> None:
        """Follow the pieces of a run of which nothing can be read, each as a run of its own."""
        log.error("run %s: nothing of it can be read; its pieces are followed", run)
        for piece in pieces:
            if piece.run.end is None:
                link = self._robots.link(piece.run.engine)
                opened = self._runs.open(piece.run, link, owns_link=False, seq=piece.seq)
                opened.alarm("led_unread", f"{UNREAD}, of which this is an action. Stop it.")
                if not piece.is_whole:
                    opened.lose("Some of what was recorded of this action cannot be read.")
                self._runs.drive(opened)

    def _engine_for(self, first: Requested) -> LeadableLink:
        facts = leading_facts(is_simulated=first.simulated)
        led = frozenset(first.actions)
        return self._simulator(facts, first.script, self._runtime.clock_us, led=led)

    def once(self, run: str, request_id: str) -> AbstractAsyncContextManager[None]:
        """Return a context that holds the lock of a person's request (by its id) on this run, so
        that a repeat of it waits for the first one. A request without an id ("") has no lock."""
        return self._claims.once(f"{run} {request_id}") if request_id else nullcontext()

    async def go_on(self, run: str, press: GoOn) -> None:
        """Let a held run go on. Raise Conflict if nothing can lead it any more, or one of its robots
        may begin no piece."""
        await self._conductor(run).go_on(press)

    def set_breakpoints(
        self, run: str, author: Author, breakpoints: tuple[Breakpoint, ...]
    ) -> None:
        """Let a run wait at these breakpoints from now on. Raise Conflict if nothing leads it."""
        self._conductor(run).gate.set_breakpoints(author, breakpoints)

    async def wait(self, run: str, author: Author, reason: str, request_id: str) -> None:
        """Let nothing further begin in a run, in the step of this call, then wait until that is
        stored. `reason`: may be "". Raise Conflict if nothing leads the run, OutcomeUnknown if it is not
        stored within 5 s: the run waits all the same."""
        self._conductor(run).gate.wait_for_person(author, reason, request_id)
        try:
            with anyio.fail_after(_STORED_S):
                await self._runs.by_id[run].recorder.flushed()
        except TimeoutError:
            text = "The run waits, but that could not be stored yet."
            raise OutcomeUnknown(text) from None

    async def hand_over(
        self, run: str, author: Author, to: Identity, pass_batons: Callable[[], Awaitable[None]]
    ) -> None:
        """Lead a run for another person, as `LedGate.hand_over` does. Raise Conflict if nothing can
        lead it any more."""
        await self._conductor(run).gate.hand_over(author, to, pass_batons)

    def _conductor(self, run: str) -> Conductor:
        conductor = self._open.get(run)
        if conductor is None:
            raise Conflict(f"{UNREAD}: only Stop is left.")
        return conductor

    def rights_changed(self, robot: str) -> None:
        """Hold the runs whose persons may begin nothing on a robot any more."""
        for conductor in tuple(self._open.values()):
            if robot in conductor.gate.robots:
                conductor.gate.rights_changed(robot)

    def hold(self, run: str, why: str) -> None:
        """Hold a led run for a reason of the runner; do nothing if nothing can lead it."""
        conductor = self._open.get(run)
        if conductor is not None:
            conductor.gate.hold_run(why)

    def question(self, run: str, question: str) -> OpenQuestion | None:
        """Return an open question of a run; None if it is not open."""
        conductor = self._open.get(run)
        return None if conductor is None else conductor.asked.find(question)

    async def answer(self, run: str, asked: OpenQuestion, given: Given) -> None:
        """Take the answer of a person in the step of this call, then wait until it is stored. Raise
        WrongAnswer or Conflict as `AskedSteps.answer` does, OutcomeUnknown if it is not stored within
        5 s."""
        self._conductor(run).asked.answer(asked, given)
        await self.answers_stored(run)

    async def answers_stored(self, run: str) -> None:
        """Wait until all that was answered in an open run so far is stored. Raise OutcomeUnknown if it is
        not within 5 s."""
        opened = self._runs.by_id.get(run)
        try:
            with anyio.fail_after(_STORED_S):
                if opened is not None:
                    await opened.recorder.flushed()
        except TimeoutError:
            text = "The answer could not be stored yet, and is tried further."
            raise OutcomeUnknown(text) from None

    def add_photo(self, run: str, asked: OpenQuestion, photo: str) -> None:
        """Keep a photo for a question, as `AskedSteps.add_photo` does."""
        self._conductor(run).asked.add_photo(asked, photo)

    def refuse_answer(self, run: str, question: str, node: str, by: Author, why: str) -> None:
        """Record that an answer to a question of a run came too late, if the run is led now."""
        conductor = self._open.get(run)
        if conductor is not None and run in self._runs.by_id:
            conductor.asked.refuse(question, node, by, why)

    async def give_word(self, run: str, node: str, word: Word) -> None:
        """Take the outcome of an action (`node`: its full name) of the run with the id `run`, as a
        person states it in `word`, and store it. Raise Conflict if no outcome is asked for,
        OutcomeUnknown if it is not stored within 5 s."""
        conductor = self._open.get(run)
        if conductor is None:
            raise Conflict("Only the outcome of an action in a run that is led can be given.")
        stored = self._runs.by_id[run].recorder.flushed
        told = conductor.give_word(node, word)
        try:
            with anyio.fail_after(_STORED_S):
                await told.wait()
                await stored()
        except TimeoutError:
            raise OutcomeUnknown("It could not be stored yet, and is tried further.") from None

    def _see(self, opened: OpenRun) -> None:
        """Notify the conductor of a piece that had ended and been closed, and moves again.
        `opened`: any run that has changed; others are ignored."""
        piece = opened.run.piece
        if piece is not None and not opened.is_led:
            conductor = self._open.get(piece.run)
            if conductor is not None:
                conductor.moves_again(opened)


def _leading(opened: OpenRun) -> Leading:
    return Leading(
        tell=opened.tell,
        stored=opened.recorder.flushed,
        stop=lambda author: opened.stop(author, ""),
        rests=opened.rests_as,
    )


async def _left_open(history: RunHistory, first: Requested, now: Run) -> LeftOpen:
    """Return how far an earlier process led a led run, from its stored events. `first`: the
    first of them; `now`: the run as all of them show it. Raise Unavailable if the journal cannot be
    read."""
    course = await stored_course(history, first)
    unproven: Run | None = None
    for piece in course.by_word:
        unproven = (await history.left(piece))[0] or unproven
    pieces: dict[int, tuple[Run, int]] = {}
    again: list[tuple[Run, int]] = []
    sent = await history.piece_ids(first.run)
    moved = await history.piece_ids(first.run, MovesAgain.kind)
    for id_ in sent:
        # Of the others the outcome is known, or a newer piece was sent for their call.
        is_open = id_ not in course.noted or id_ in course.newest.values()
        if not is_open and id_ not in moved:
            continue
        left, seq = await _left_piece(history, id_)
        if left.piece is not None and is_open and left.piece.call not in course.over:
            pieces[left.piece.call] = left, seq
        elif id_ in moved and left.end is None:
            again.append((left, seq))
    return LeftOpen(
        order=order_of(first),
        course=LedCourse(began=course.began, steps=course.steps),
        sent=max(map(piece_number, sent), default=0),
        pieces=pieces,
        again=tuple(again),
        states={name: each.state for name, each in now.actions.items()},
        unproven=unproven,
        calls=course.calls,
        played=course.played,
        breakpoints=now.breakpoints,
        asked=course.asked,
        pauses=course.pauses,
    )


async def _left_piece(history: RunHistory, id_: str) -> tuple[Run, int]:
    """Return the stored piece with the id `id_`, and the number (`seq`) of its last event. Raise
    msgspec.DecodeError if some of its events cannot be read."""
    piece, seq, is_whole = await history.left(id_)
    if piece is None or not is_whole:
        raise msgspec.DecodeError(f"Some events of {id_} cannot be read.")
    return piece, seq
