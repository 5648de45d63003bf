"""The engine of one robot, watched: whether it answers, which graphs it holds, what it has indexed.

`KnownEngine` is a link around the robot's link. Runs use it like any other, and each answer or
report that passes is noted, so that nothing is asked twice.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Collection
from contextlib import AbstractContextManager
from typing import Final, TypeVar

import anyio
import msgspec

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import (
    Answer,
    EngineChanged,
    EngineState,
    Feedback,
    ForeignCommand,
    Leaves,
    Link,
    NoAnswer,
    Order,
    Registration,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph, Signature
from action_assistant.umrf.signatures import signature_of

log: Final = logging.getLogger(__name__)

_IDLE_S: Final = 10.0
_CLOSE_S: Final = 1.0
_AROUND_S: Final = 1.0
_AFTERWARDS_S: Final = 30.0
_GET_S: Final = 1.0
_SHARE: Final = 20  # at most one part in so many of the time goes into asking an idle engine
#: An engine that indexes while it runs may die of a get or a start that comes meanwhile (H15). So it is asked
#: this many times more rarely, and not at all for `_INDEXES_S` after its folder was written, which is more
#: than twice the node's default interval of indexing.
_RARELY: Final = 6
_INDEXES_S: Final = 5.0
_FRESH_S: Final = 60.0  # an engine that came back is called restarted for so long

T = TypeVar("T")
RunInAnyWay = Callable[..., Awaitable[T]]


class EngineIndex(msgspec.Struct, frozen=True, kw_only=True):
    """The actions and graphs that an engine has indexed, by name. `described`: the contents of the
    files of these actions. `unread`: how many texts of the index cannot be read."""

    actions: dict[str, Signature] = {}
    described: dict[str, Action] = {}
    graphs: dict[str, Graph] = {}
    unread: int = 0


class EngineListeners(msgspec.Struct, frozen=True, kw_only=True):
    """The functions that are called with what an engine reports. `changed`: the page has to show
    something else; `became`: the engine has changed its state; `commanded`: somebody else has sent
    it a command; `shows`: an answer or feedback shows these graphs."""

    changed: Callable[[], None]
    became: "Callable[[KnownEngine], None]"
    commanded: "Callable[[KnownEngine, ForeignCommand], None]"
    shows: "Callable[[KnownEngine, tuple[Snapshot, ...]], None]"


class KnownEngine:
    """Watches an engine while `watch` runs. `indexes`: the runner writes into the folder that the
    engine indexes while it runs."""

    def __init__(
        self,
        registration: Registration,
        facts: EngineFacts,
        link: Link,
        *,
        clock_us: ClockUs,
        listeners: EngineListeners,
        recordings: Recordings | None,
        indexes: bool,
    ) -> None:
        self.registration = registration
        self.facts = facts
        self.state: EngineState = link.standing.state
        self.why = link.standing.why
        self.since = clock_us()
        self.restarted_at: int | None = None
        self.answer: Answer | None = None
        self.took_ms: float | None = None
        self._link = link
        self._clock_us = clock_us
        self._listeners = listeners
        self._recordings = recordings
        self._rarely = _RARELY if indexes else 1
        self._indexing_until = 0.0
        self._look = anyio.Event()
        self._tried_at = -_IDLE_S
        self._restarted: float | None = None
        self._close_until = 0.0
        self._index: tuple[tuple[tuple[str, ...], tuple[str, ...]], EngineIndex] = (
            ((), ()),
            EngineIndex(),
        )

    # --- the link -----------------------------------------------------------------------------

    @property
    def simulated(self) -> bool:
        """True for a simulated engine, which moves no robot."""
        return self._link.simulated

    @property
    def pauses(self) -> bool:
        """True if pausing is safe: the profile says so, and the link supports it."""
        return self._link.pauses

    @property
    def standing(self) -> Standing:
        """The present state of the engine, as far as the link knows it without asking."""
        return self._link.standing

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        await self._link.start(order, leaves)

    async def stop(self, graph_name: str) -> None:
        await self._link.stop(graph_name)

    async def pause(self, graph_name: str) -> None:
        await self._link.pause(graph_name)

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        await self._link.resume(graph_name, continue_from, leaves)

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one modify message. `leaves`: as for a start. Raise NotSent if it could not be sent,
        EngineRefused if the engine refuses the change."""
        await self._link.modify(order, continue_from, leaves)

    async def get(self) -> Answer:
        """Ask the engine with a get for all graphs that it holds, and note the answer. Raise
        NoAnswer if no answer comes."""
        began = self._tried_at = anyio.current_time()
        try:
            answer = await self._link.get()
        except NoAnswer as nothing:
            self._silent(str(nothing))
            raise
        except Exception as error:  # a broken link counts as no answer
            why = f"The link failed: {error!r}"
            if why != self.why:
                log.exception("the link to %s failed", self.registration.name)
            self._silent(why)
            raise NoAnswer(why) from error
        except anyio.get_cancelled_exc_class():
            # Cancelled by the deadline of this get, not at the end of its task?
            if anyio.current_time() - began >= 0.9 * _GET_S:
                self._silent("")
            raise
        self._heard(answer, anyio.current_time() - began)
        return answer

    async def run(self) -> None:
        """Wait for ever: the watch keeps the link going."""
        await anyio.sleep_forever()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Call `hear` with every report of the engine, as long as the context is open."""
        return self._link.listen(hear)

    async def aclose(self) -> None:
        """Do nothing: the watch closes the link."""

    # --- the watch ----------------------------------------------------------------------------

    async def watch(self) -> None:
        """Keep the link going and the state of the engine known, until cancelled."""
        self.look_closely()
        with self._link.listen(self._hear):
            try:
                async with anyio.create_task_group() as tasks:
                    tasks.start_soon(self._keep_link)
                    tasks.start_soon(self._ask)
                    tasks.start_soon(self._look_around)
            finally:
                with anyio.CancelScope(shield=True):
                    await self._link.aclose()

    async def _keep_link(self) -> None:
        while True:
            try:
                await self._link.run()
            except Exception:
                log.exception("the link to %s failed and is begun again", self.registration.name)
            await anyio.sleep(0.5)

    async def _look_around(self) -> None:
        """Announce changes of the link's standing, such as other publishers, which the engine does
        not report."""
        known = self._link.standing
        while True:
            await anyio.sleep(_AROUND_S)
            now = self._link.standing
            if now != known:
                known = now
                self._listeners.changed()

    async def _ask(self) -> None:
        """Send a get every ten seconds: more rarely where answers are slow or the engine indexes,
        at once after news."""
        while True:
            pace = _CLOSE_S if anyio.current_time() < self._close_until else _IDLE_S
            rest = max(pace * self._rarely, _SHARE * (self.took_ms or 0) / 1000)
            due = self._tried_at + rest - anyio.current_time()
            if due > 0:
                with anyio.move_on_after(due) as waited:
                    await self._look.wait()
                if waited.cancelled_caught:
                    continue  # another get may have been sent meanwhile
            await self.indexed()
            self._look = anyio.Event()
            try:
                with anyio.fail_after(_GET_S):
                    await self.get()
            except (NoAnswer, TimeoutError):
                pass  # noted
            except Exception:
                log.exception("asking %s failed", self.registration.name)
                await anyio.sleep(0.5)

    def look_closely(self) -> None:
        """Ask the engine more often for a while, since a run has ended or somebody else has sent a
        command."""
        now = _now()
        if now >= self._close_until:
            self._look.set()
        self._close_until = now + _AFTERWARDS_S

    def let_index(self) -> None:
        """Delay the next regular get until the engine has read what was just written into its index
        folder. Gets of runs and of Stops continue."""
        self._indexing_until = _now() + _INDEXES_S
        self._look.set()

    async def indexed(self) -> None:
        """Wait until the engine has had time to read what the runner last wrote into its index
        folder."""
        await anyio.sleep_until(self._indexing_until)

    def _hear(self, report: Report) -> None:
        if isinstance(report, Feedback):
            self._listeners.shows(self, report.snapshots)
        match report:
            case EngineChanged(state=("gone" | "busy") as state, why=why):
                self._turn(state, why)
            case EngineChanged():
                self._look.set()
            case Feedback() if self._recordings is not None:
                self._recordings.record_feedback(self.registration.name, report)
            case ForeignCommand():
                if not report.targets or self.registration.name in report.targets:
                    self._listeners.commanded(self, report)
                self._look.set()  # the engine may obey after that answer: ask again later
                self.look_closely()
            case _:
                return

    def _heard(self, answer: Answer, took: float) -> None:
        if self._recordings is not None:
            self._recordings.record_answer(self.registration.name, answer)
        known = self.answer
        now = anyio.current_time()
        lives = {answer.incarnation} | ({known.incarnation} if known is not None else set())
        if len(lives - {""}) > 1:
            self.restarted_at, self._restarted = answer.at, now
        self.answer, self.took_ms = answer, 1000 * took
        fresh = self._restarted is not None and now - self._restarted < _FRESH_S
        self._turn("restarted" if fresh else "answering", "")
        if known is None or _held(known) != _held(answer):
            self._listeners.changed()
        self._listeners.shows(self, answer.graphs)

    def _silent(self, why: str) -> None:
        standing = self._link.standing
        gone = standing.state == "gone"
        reason = why or standing.why or "It is there, but does not answer a get within a second."
        self._turn("gone" if gone else "busy", reason)

    def _turn(self, state: EngineState, why: str) -> None:
        if (state, why) == (self.state, self.why):
            return
        if state != self.state:
            self.since = self._clock_us()
        is_other = state != self.state
        self.state, self.why = state, why
        if is_other:
            self._listeners.became(self)
        self._listeners.changed()

    async def index(self, run_in_worker: "RunInAnyWay[EngineIndex]") -> EngineIndex:
        """Return the actions and graphs that the engine has indexed, as of its last answer. A
        changed index is decoded in a worker."""
        answer = self.answer
        if answer is None:
            return EngineIndex()
        texts = answer.known_actions, answer.known_graphs
        if texts != self._index[0]:
            self._index = texts, await run_in_worker(read_index, *texts)
        return self._index[1]


def _now() -> float:
    """Return the time of `anyio.current_time`, also outside of any task, where reports are
    heard."""
    return asyncio.get_running_loop().time()


def read_index(actions: tuple[str, ...], graphs: tuple[str, ...]) -> EngineIndex:
    """Decode the index of an engine. Texts that cannot be read are counted."""
    described: dict[str, Action] = {}
    whole: dict[str, Graph] = {}
    unread = 0
    for text in actions:
        try:
            action = codec.read_action(text).action
        except codec.Unreadable:
            unread += 1
        else:
            described.setdefault(action.name, action)  # the engine takes the first, too
    for text in graphs:
        try:
            graph = codec.read(text).graph
        except codec.Unreadable:
            unread += 1
        else:
            whole.setdefault(graph.name, graph)
    known = {name: signature_of(action) for name, action in described.items()}
    return EngineIndex(actions=known, described=described, graphs=whole, unread=unread)


def foreign_graphs(answer: Answer, own_runs: Collection[str]) -> list[str]:
    """Return the names of the graphs on an engine that somebody else has started. `own_runs`: the
    ids of this runner's runs.

    A graph counts as running also before its first action and between two actions. A running
    sub-graph counts as its top graph.
    """
    held = {each.graph for each in answer.graphs}
    own = {each.graph for each in answer.graphs if each.run in own_runs}
    tops = {
        each.graph
        for each in answer.graphs
        if (each.active or (each.state == "RUNNING" and not _within(each.graph, held)))
        and (each.run is None or each.run not in own_runs)
        and not (each.run is None and _within(each.graph, own))
    }
    return sorted(name for name in tops if not _within(name, tops))


def _within(name: str, graphs: Collection[str]) -> bool:
    """Return whether a graph is a sub-graph of one of these."""
    return any(name.startswith(f"{each}__") for each in graphs)


def _held(answer: Answer) -> list[tuple[str, str, str | None, bool]]:
    return [(each.graph, each.state, each.run, each.active) for each in answer.graphs]
