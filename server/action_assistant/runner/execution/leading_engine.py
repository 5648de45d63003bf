"""The engine that plays the whole graph of a led run.

It moves nothing. It says which action begins and which one has to stop, and is told the outcomes. When
it fails, another one takes its place and is brought to the same point of the run by what has happened
so far (`LedCourse`).
"""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from typing import Final

import anyio
import msgspec
from anyio.abc import TaskGroup

from action_assistant.errors import Conflict
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.conducted_steps import LeftOpen, order_of
from action_assistant.runner.links.led_calls import CourseStep, LedCourse, Played, Stopped
from action_assistant.runner.links.observations import GraphState
from action_assistant.runner.links.port import (
    Answer,
    CallBegan,
    EngineChanged,
    EngineRefused,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    Transitions,
)
from action_assistant.runner.links.simulator import LeadableLink
from action_assistant.runner.runs.events import Requested
from action_assistant.umrf.semantics import Call, Returned

log: Final = logging.getLogger(__name__)

_MOST_ENGINES: Final = 3  # that are begun for one run after the first


class LeadingEngine:
    """Plays the whole graph of a led run, whichever simulated engine does that now. `first`: the first
    event of the run; `engine`: the first engine, and `make_engine` makes another one; `hold` holds
    the run for a reason, and `give_up` is called when no engine can be had any more; `left`: how far
    an earlier process led the run, None for a new one."""

    def __init__(
        self,
        first: Requested,
        engine: LeadableLink,
        make_engine: Callable[[], LeadableLink],
        clock_us: ClockUs,
        *,
        hold: Callable[[str], None],
        give_up: Callable[[], None],
        left: LeftOpen | None = None,
    ) -> None:
        self._first = first
        self._engine = engine
        self._make_engine = make_engine
        self._clock_us = clock_us
        self._hold = hold
        self._give_up = give_up
        self._hear: Callable[[Report], None] = _ignore
        self._listening = ExitStack()
        self._failed = anyio.Event()  # the engine has ended by itself
        self._replaced = 0
        self._is_where_the_run_is = left is None
        #: None can be had any more: only Stop is left.
        self.is_past_help = False
        self._began = left.course.began if left is not None else first.at
        past = () if first.before is None else first.before.ends
        self._course: list[tuple[float, CourseStep]] = (
            list(left.course.steps) if left is not None else [(e.ms, e.returned) for e in past]
        )
        #: The full names of the actions of the calls that were reported, by number.
        before = first.before.calls if first.before is not None else {}
        self._calls = dict(left.calls if left is not None else before)
        #: The calls that have an outcome, or that the engine plays: another engine asks for none.
        self._over = {step.number for _, step in self._course if not isinstance(step, Stopped)}

    def listen(self, hear: Callable[[Report], None]) -> None:
        """Call `hear` with each report of the engine that concerns the run; call this once."""
        self._hear = hear
        self._listening.enter_context(self._engine.listen(self._pass_on))

    @property
    def standing(self) -> Standing:
        """The condition of the engine. Its incarnation is the id of the run, as engines change."""
        life = self._first.run
        if self.is_past_help:
            return Standing(state="answering", incarnation=life, generation="current", servers=1)
        return msgspec.structs.replace(self._engine.standing, incarnation=life)

    def require(self) -> None:
        """Raise Conflict unless an engine leads the run now."""
        if self.is_past_help:
            raise Conflict("What leads this run has failed too often: only Stop is left.")
        if not self._is_where_the_run_is:
            raise Conflict("What leads this run is being begun again. Try that in some seconds.")

    async def start(self, order: Order, leaves: Leaves) -> None:
        """Start the whole graph, or continue it where the earlier run ended. `leaves` is called right
        before that. Raise EngineRefused if the engine refuses it, NotSent or NoAnswer if it cannot be
        started."""
        before = self._first.before
        if before is None:
            self._began = self._clock_us()
            await self._engine.start(order, leaves)
            return
        leaves()
        now = self._clock_us()
        self._began = now - round(before.took_ms * 1000)
        await self._engine.take_up(
            order, LedCourse(began=self._began, steps=tuple(self._course), calls=dict(self._calls))
        )
        running = GraphState(now, self._first.graph_name, "RUNNING")
        self._hear(Transitions(run=self._first.run, changes=(running,)))

    async def stop(self, graph_name: str) -> None:
        """Stop the whole graph, in this engine and in each that takes its place."""
        if not self._is_stopped:
            self._note(Stopped())
        await self._engine.stop(graph_name)

    async def stop_first(self, graph_name: str) -> None:
        """Stop the whole graph as `stop` does, unless that has been done."""
        if not self._is_stopped:
            await self.stop(graph_name)

    @property
    def _is_stopped(self) -> bool:
        return any(isinstance(step, Stopped) for _, step in self._course)

    async def returned(self, returned: Returned) -> None:
        """Give the engine the end of a call, which another engine would be given, too."""
        self._over.add(returned.number)
        self._note(returned)
        with suppress(NotSent, NoAnswer):  # another engine is told by the course
            await self._engine.returned(returned)

    async def play(self, call: Call) -> None:
        """Let the engine itself play a call, which begins by that."""
        self._over.add(call.number)
        self._note(Played(call.number, call.node))
        await self._engine.play(call.number)

    def _note(self, step: CourseStep) -> None:
        self._course.append(((self._clock_us() - self._began) / 1000, step))

    async def get(self) -> Answer:
        """Return the whole graph. Raise NoAnswer while the engine has ended and no other one has
        taken its place."""
        if not self._is_where_the_run_is:
            raise NoAnswer("What leads this run is being begun again.")
        return await self._engine.get()

    async def run(self) -> None:
        """Keep an engine where the run is, until cancelled."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._engine.run)
            if not self._is_where_the_run_is:
                await self._bring_back()
            while True:
                await self._failed.wait()
                self._failed = anyio.Event()
                await self._replace(tasks)

    async def aclose(self) -> None:
        """End the engine that leads the run now, and stop listening to it."""
        self._listening.close()
        await self._engine.aclose()

    def _pass_on(self, report: Report) -> None:
        if isinstance(report, CallBegan):
            self._calls[report.call.number] = report.call.node
        match report:
            case CallBegan(call=call) if call.number in self._over:
                return
            case EngineChanged(state=("gone" | "busy"), why=why):
                self._hold(f"What leads this run has failed, and was begun again. {why}")
                self._failed.set()
            case _:
                self._hear(report)

    async def _replace(self, tasks: TaskGroup) -> None:
        """Make another engine in place of one that has failed, and bring it to the same point of
        the run. After too many failures, make none: only Stop is left."""
        if self.is_past_help:
            return
        self._is_where_the_run_is = False
        if self._replaced >= _MOST_ENGINES:
            self.is_past_help = True
            self._give_up()
            return
        self._replaced += 1
        old, self._engine = self._engine, self._make_engine()
        self._listening.enter_context(self._listening_to(self._engine))
        tasks.start_soon(self._engine.run)
        await self._bring_back()
        await old.aclose()

    def _listening_to(self, engine: LeadableLink) -> AbstractContextManager[None]:
        return engine.listen(self._pass_on)

    async def _bring_back(self) -> None:
        """Give a new engine what has happened so far. If that fails, hold the run and replace it."""
        known = len(self._course)
        try:
            course = LedCourse(
                began=self._began, steps=tuple(self._course), calls=dict(self._calls)
            )
            await self._engine.take_up(order_of(self._first), course)
            self._is_where_the_run_is = True
            for _, step in self._course[known:]:
                match step:
                    case Stopped():
                        await self._engine.stop(self._first.graph_name)
                    case Played(number=number):
                        await self._engine.play(number)
                    case Returned():
                        await self._engine.returned(step)
        except (EngineRefused, NotSent, NoAnswer) as why:
            log.warning("run %s: no engine leads it: %s", self._first.run, why)
            self._hold(f"What leads this run cannot be begun again: {why}")
            self._failed.set()


def _ignore(_report: Report) -> None:
    """Ignore a report that comes before anybody listens."""
