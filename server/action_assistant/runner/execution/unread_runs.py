"""A led run that an earlier process left, of whose events some cannot be read.

Nobody knows which of its actions are over, so nothing leads it further. Its pieces are runs with events of
their own: they are followed, shown and stopped, and the run is unknown until that is done.
"""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from typing import Final, NoReturn

import anyio

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.conducted_steps import (
    RUNNER,
    Leading,
    RestNews,
    Step,
    seen_inside,
    seen_of,
)
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.run_loop import OpenRun, PieceHooks
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.links.port import (
    Answer,
    NoAnswer,
    NotSent,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.semantics import Call

UNREAD: Final = "Some of what was recorded of this run cannot be read"


class UnreadRun:
    """The link of a led run of which some events cannot be read, so that it can only be
    stopped. It answers only once a Stop was pressed and no piece may move. `lacking`: the ids of
    pieces of which nothing can be read, so that their robots are unknown."""

    simulated: Final = False
    pauses: Final = False

    def __init__(
        self, run: Run, lacking: Iterable[str], *, runs: OpenRuns, clock_us: ClockUs
    ) -> None:
        self._run = run
        self._runs = runs
        self._clock_us = clock_us
        self._subscribers = Listeners[Report]()
        self._leading: Leading | None = None
        self._is_closed = False
        self._stopped_by = run.stopped_by or RUNNER
        self._unproven: Run | None = None
        self._states = {name: each.state for name, each in run.actions.items()}
        self._rests = RestNews(lambda event: self._told.tell(event), clock_us)
        names = ", ".join(lacking)
        self._lacking = f" Nothing can be read of {names}." if names else ""

    @property
    def why(self) -> str:
        """The sentence for people that says why the run is unknown."""
        return (
            f"{UNREAD}, so nothing leads it further: look at its robots. What they are known to do is "
            f"followed, and a Stop reaches it.{self._lacking}"
        )

    @property
    def _told(self) -> Leading:
        assert self._leading is not None
        return self._leading

    def leads(self, leading: Leading) -> None:
        """Set `leading`, through which events of the run are shown and recorded. Call this before
        `follow`."""
        self._leading = leading

    def follow(self, piece: Run, seq: int, robots: Robots, *, is_whole: bool) -> None:
        """Follow a piece of the run until it has ended. `seq`: the number of its last stored event;
        `is_whole`: all of its events could be read; if not, no answer can prove it at rest."""
        assert piece.piece is not None
        call = Call(
            number=piece.piece.call,
            graph=self._run.graph_name,
            node=piece.piece.node,
            name=piece.piece.node.rpartition("_")[0],
            inputs={},
            outputs={},
        )
        step = Step(call, piece.engine)
        if piece.end is not None:
            self._show(step, piece)
            return
        hooks = PieceHooks(changed=lambda piece: self._show(step, piece.run), may_leave=unwatched)
        link = robots.link(piece.engine)
        opened = self._runs.open(piece, link, owns_link=False, seq=seq, piece=hooks)
        if not is_whole:
            opened.lose("Some of what was recorded of this action cannot be read.")
        if self._run.desired == "stopped":
            opened.stop(self._stopped_by, "")
        self._runs.drive(opened)

    def _show(self, step: Step, piece: Run) -> None:
        action = piece.actions[step.node]
        unseen = piece.end is not None and action.state in ACTIVE
        state = "ERROR" if unseen else action.state
        step.run = piece
        if action is not step.shown or state != self._states.get(step.node):
            step.shown, self._states[step.node] = action, state
            self._told.tell(seen_of(step, action, state, self._clock_us()))
        for event in seen_inside(step, self._run.graph_name, self._clock_us()):
            self._told.tell(event)
        self._rests.show(piece)
        if piece.at_rest is not None:
            self._unproven = piece

    def _open(self) -> list[OpenRun]:
        """Return the pieces of this run that may move, also those that had ended and move again."""
        found = (each for each in self._runs.by_id.values() if each.run.piece is not None)
        return [
            each
            for each in found
            if each.run.end is None and each.run.piece and each.run.piece.run == self._run.id
        ]

    # --- the link -----------------------------------------------------------------------------

    @property
    def standing(self) -> Standing:
        """The condition of an engine that answers, with the id of the run as its process, so that
        the run can be proven to be stopped."""
        life = self._run.incarnation or self._run.id
        return Standing(state="answering", incarnation=life, generation="current", servers=1)

    def close(self, author: Author) -> None:
        """Begin to stop every piece. The call never waits. `author` has pressed Stop."""
        self._is_closed, self._stopped_by = True, author
        for piece in self._open():
            piece.stop(author, "")

    async def stop(self, graph_name: str) -> None:
        """Begin to stop the pieces that are not being stopped, such as one that moves again, and
        return at once. Stop messages are then sent for each piece until it is proven at rest."""
        self._is_closed = True
        for piece in self._open():
            if piece.run.desired != "stopped":
                piece.stop(self._stopped_by, "")

    async def get(self) -> Answer:
        """Return the whole graph as stopped. Raise NoAnswer before a Stop, while a piece may move,
        or if some pieces are unknown."""
        moving = self._open()
        if not self._is_closed or self._lacking:
            raise NoAnswer(self.why)
        if moving:
            names = ", ".join(sorted({each.run.engine for each in moving}))
            raise NoAnswer(f"{UNREAD}, and its pieces on {names} are not proven at rest.")
        if self._unproven is not None:
            self._told.rests(self._unproven)
        at, life = self._clock_us(), self.standing.incarnation
        nodes = {
            name: "ERROR" if state in ACTIVE else state for name, state in self._states.items()
        }
        name, run = self._run.graph_name, self._run.id
        shown = Snapshot(at, name, "STOPPED", nodes, asked_at=at, run=run)
        return Answer(asked_at=at, at=at, incarnation=life, graphs=(shown,))

    async def _refuse(self, *_: object, **__: object) -> NoReturn:
        """Raise NotSent: such a run takes no commands but Stop."""
        raise NotSent(self.why)

    start = pause = resume = modify = _refuse

    async def run(self) -> None:
        """Wait until cancelled: the pieces are driven as runs of their own."""
        await anyio.sleep_forever()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` would be called with reports; such a run has none."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """Do nothing. Pieces that are still open go on as runs."""
