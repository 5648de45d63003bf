"""The engine of one robot as watched: whether it answers, its graphs, its index.

A link around the link. Runs use it like any other, and everything that is heard on the way is noted,
so that nobody asks twice.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Collection
from contextlib import AbstractContextManager
from typing import Final, TypeVar

import anyio
import msgspec

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
#: An engine that indexes while it runs may die of each get and start that comes meanwhile (H15), so that it
#: is asked this much more rarely, and not at all for `_INDEXES_S` after its folder was written: twice what
#: the node takes from one indexing to the next, unless it is told otherwise, and some.
_RARELY: Final = 6
_INDEXES_S: Final = 5.0
_FRESH_S: Final = 60.0  # for so long an engine that came back is called restarted

T = TypeVar("T")
RunInAnyWay = Callable[..., Awaitable[T]]


class EngineIndex(msgspec.Struct, frozen=True, kw_only=True):
    """What an engine can do: actions and graphs that it has indexed, by name. `described`: what the
    files of these actions say. `unread`: texts of its index that cannot be read."""

    actions: dict[str, Signature] = {}
    described: dict[str, Action] = {}
    graphs: dict[str, Graph] = {}
    unread: int = 0


class KnownEngine:
    """Watched from `watch` on, until that is cancelled.

    `changed` is called whenever people would see something else; `foreign` for each command of
    somebody else; `became` when the engine is in another state than before; `shows` for all graphs
    that an answer or feedback shows. `indexes`: the runner writes into the folder that it indexes, so that
    it does so while it runs.
    """

    def __init__(
        self,
        registration: Registration,
        facts: EngineFacts,
        link: Link,
        *,
        clock_us: Callable[[], int],
        changed: Callable[[], None] = lambda: None,
        became: "Callable[[KnownEngine], None]" = lambda _: None,
        foreign: "Callable[[KnownEngine, ForeignCommand], None]" = lambda _, __: None,
        shows: "Callable[[KnownEngine, tuple[Snapshot, ...]], None]" = lambda _, __: None,
        recordings: Recordings | None = None,
        indexes: bool = False,
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
        self._changed = changed
        self._became = became
        self._foreign = foreign
        self._shows = shows
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
        """Whether nothing moves in the world."""
        return self._link.simulated

    @property
    def pauses(self) -> bool:
        """Whether pausing is safe: the profile says so, and the link can."""
        return self._link.pauses

    @property
    def standing(self) -> Standing:
        """What is known without asking."""
        return self._link.standing

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Publish one start message. Raises NotSent, EngineRefused."""
        await self._link.start(order, leaves)

    async def stop(self, graph_name: str) -> None:
        """Publish one stop message. Raises NotSent."""
        await self._link.stop(graph_name)

    async def pause(self, graph_name: str) -> None:
        """Publish one pause message. Raises NotSent."""
        await self._link.pause(graph_name)

    async def resume(self, graph_name: str, continue_from: str = "") -> None:
        """Publish one resume message. Raises NotSent."""
        await self._link.resume(graph_name, continue_from)

    async def modify(self, order: Order, continue_from: str = "") -> None:
        """Publish one modify message. Raises NotSent, EngineRefused."""
        await self._link.modify(order, continue_from)

    async def get(self) -> Answer:
        """Ask what the engine holds, and note it. Raises NoAnswer."""
        began = self._tried_at = anyio.current_time()
        try:
            answer = await self._link.get()
        except NoAnswer as nothing:
            self._silent(str(nothing))
            raise
        except Exception as error:  # a link that breaks is one without an answer
            why = f"The link failed: {error!r}"
            if why != self.why:
                log.exception("the link to %s failed", self.registration.name)
            self._silent(why)
            raise NoAnswer(why) from error
        except anyio.get_cancelled_exc_class():
            if anyio.current_time() - began >= 0.9 * _GET_S:  # somebody's deadline, not the end
                self._silent("")
            raise
        self._heard(answer, anyio.current_time() - began)
        return answer

    async def run(self) -> None:
        """The watch keeps the link going."""
        await anyio.sleep_forever()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Be told everything that the engine shows by itself."""
        return self._link.listen(hear)

    async def aclose(self) -> None:
        """The link is let go of by whoever ends the watch."""

    # --- the watch ----------------------------------------------------------------------------

    async def watch(self) -> None:
        """Keep the link going and know how the engine is, until cancelled."""
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
        """Who else is there changes without a word of the engine."""
        told = self._link.standing
        while True:
            await anyio.sleep(_AROUND_S)
            now = self._link.standing
            if now != told:
                told = now
                self._changed()

    async def _ask(self) -> None:
        """Every ten seconds, more rarely when answers are dear, at once when there is news."""
        while True:
            pace = _CLOSE_S if anyio.current_time() < self._close_until else _IDLE_S
            rest = max(pace * self._rarely, _SHARE * (self.took_ms or 0) / 1000)
            due = self._tried_at + rest - anyio.current_time()
            if due > 0:
                with anyio.move_on_after(due) as waited:
                    await self._look.wait()
                if waited.cancelled_caught:
                    continue  # somebody else may have asked meanwhile
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
        """A run has ended there, or others told it something: what comes of that is asked more
        often for a while."""
        now = _now()
        if now >= self._close_until:
            self._look.set()
        self._close_until = now + _AFTERWARDS_S

    def let_index(self) -> None:
        """What it indexes was just written: ask it again when it has read that, and not before. Gets that
        a run or a Stop needs go on."""
        self._indexing_until = _now() + _INDEXES_S
        self._look.set()

    async def indexed(self) -> None:
        """Wait until the engine has read what was written last."""
        await anyio.sleep_until(self._indexing_until)

    def _hear(self, report: Report) -> None:
        if isinstance(report, Feedback):
            self._shows(self, report.snapshots)
        match report:
            case EngineChanged(state=("gone" | "busy") as state, why=why):
                self._turn(state, why)
            case EngineChanged():
                self._look.set()
            case Feedback() if self._recordings is not None:
                self._recordings.fed(self.registration.name, report)
            case ForeignCommand():
                self._foreign(self, report)
                self._look.set()  # and later, too: it may be obeyed after the answer
                self.look_closely()
            case _:
                return

    def _heard(self, answer: Answer, took: float) -> None:
        if self._recordings is not None:
            self._recordings.heard(self.registration.name, answer)
        known = self.answer
        now = anyio.current_time()
        lives = {answer.incarnation} | ({known.incarnation} if known is not None else set())
        if len(lives - {""}) > 1:
            self.restarted_at, self._restarted = answer.at, now
        self.answer, self.took_ms = answer, 1000 * took
        fresh = self._restarted is not None and now - self._restarted < _FRESH_S
        self._turn("restarted" if fresh else "answering", "")
        if known is None or _held(known) != _held(answer):
            self._changed()
        self._shows(self, answer.graphs)

    def _silent(self, why: str) -> None:
        standing = self._link.standing
        gone = standing.state == "gone"
        said = why or standing.why or "It is there, but does not answer a get within a second."
        self._turn("gone" if gone else "busy", said)

    def _turn(self, state: EngineState, why: str) -> None:
        if (state, why) == (self.state, self.why):
            return
        if state != self.state:
            self.since = self._clock_us()
        is_other = state != self.state
        self.state, self.why = state, why
        if is_other:
            self._became(self)
        self._changed()

    async def index(self, run_in_worker: "RunInAnyWay[EngineIndex]") -> EngineIndex:
        """What the engine has indexed, as its last answer says; read when it has changed."""
        answer = self.answer
        if answer is None:
            return EngineIndex()
        texts = answer.known_actions, answer.known_graphs
        if texts != self._index[0]:
            self._index = texts, await run_in_worker(read_index, *texts)
        return self._index[1]


def _now() -> float:
    """Return what `anyio.current_time` does, also where what comes by itself is heard: in no task."""
    return asyncio.get_running_loop().time()


def read_index(actions: tuple[str, ...], graphs: tuple[str, ...]) -> EngineIndex:
    """The index of an engine from its texts. What cannot be read is counted."""
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


def foreign_graphs(answer: Answer, going: Collection[str]) -> list[str]:
    """The graphs that an engine runs and that are no runs of ours `going` on there: also those of
    which no action has begun yet, or none moves right now. Sub-graphs are named by their graph."""
    held = {each.graph for each in answer.graphs}
    tops = {
        each.graph
        for each in answer.graphs
        if (each.active or (each.state == "RUNNING" and not _within(each.graph, held)))
        and (each.run is None or each.run not in going)
    }
    return sorted(name for name in tops if not _within(name, tops))


def _within(name: str, graphs: Collection[str]) -> bool:
    """Whether it is a sub-graph of one of them."""
    return any(name.startswith(f"{each}__") for each in graphs)


def _held(answer: Answer) -> list[tuple[str, str, str | None, bool]]:
    return [(each.graph, each.state, each.run, each.active) for each in answer.graphs]
