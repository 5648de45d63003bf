"""The link to a simulated engine in a process of its own: nothing it computes holds up the runner.

The process runs `SimulatorLink`; here is its other end. Commands and answers travel as pickled
tuples behind their length. It ends with the runner, and by itself when nobody listens any more.
"""

import asyncio
import itertools
import logging
import pickle
import secrets
import socket
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, suppress
from functools import partial
from typing import Any, Final
from weakref import WeakSet

import anyio
import msgspec
from anyio import to_thread

from action_assistant.errors import TooMany
from action_assistant.kit.clock import utc_us
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import (
    BehaviourPerformer,
    bound_address_space,
)
from action_assistant.runner.links.led_calls import LedCalls, LedCourse
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.port import (
    Answer,
    EngineChanged,
    EngineRefused,
    EngineState,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    Transitions,
    unwatched,
)
from action_assistant.runner.links.simulator import SimulatorLink, engine_of
from action_assistant.runner.workers import child
from action_assistant.system.posix import cause_of_end
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.semantics import Returned

log: Final = logging.getLogger(__name__)

_HEAD: Final = 4  # bytes of a length
_CHANGES: Final = 100  # in one report, which the runner takes in without a pause
#: Simulated runs at a time; each takes 15 MB, and its part of the processors.
MOST: Final = 64
#: The limit for those with behaviours, each of which may have many processes.
MOST_WITH_BEHAVIOURS: Final = 8
_WAITING: Final = 16_384  # bytes under way; an answer comes after all earlier reports
_NICE: Final = 10
_REST: Final = 3  # simulated runs pause for so many times the time that a report took
_START_S: Final = 4.0  # less than a start may take
_ENDING_S: Final = 4.0  # that an engine has to end its behaviours
_GONE: Final = "The simulated engine was switched off."
_DIED: Final = "The process of the simulated engine has died, and the engine with it."

_COMMANDS: Final = frozenset(
    {"start", "stop", "pause", "resume", "modify", "get", "returned", "play", "take_up"}
)


class Simulators:
    """Makes links to simulated engines, and bounds the share of the runner's time that their reports take in
    total."""

    def __init__(self) -> None:
        self._turn = anyio.Lock()
        self._links: WeakSet[SimulatedLink] = WeakSet()

    def __call__(
        self,
        facts: EngineFacts,
        script: str,
        clock_us: Callable[[], int],
        behaviours: BehaviourFolder | None = None,
        led: frozenset[str] = frozenset(),
    ) -> "SimulatedLink":
        """Return a link to a new simulated engine, whose process begins with its first start.
        `facts`: the engine build to simulate; `script`: how its actions act (JSON, "" for none);
        `behaviours`: the folder of Python behaviours of actions, or None; `led`: full names of
        actions that robots carry out. Raise TooMany if too many simulated engines are alive."""
        going = [each for each in self._links if each.is_alive]
        if len(going) >= MOST:
            raise TooMany(f"{MOST} simulated runs go on already; stop some, or wait.")
        with_behaviours = sum(each.has_behaviours for each in going)
        if behaviours is not None and with_behaviours >= MOST_WITH_BEHAVIOURS:
            most = MOST_WITH_BEHAVIOURS
            raise TooMany(f"{most} runs with behaviours go on already; stop some, or wait.")
        link = SimulatedLink(_EngineConfig(facts, script, behaviours, led), clock_us, self.take)
        self._links.add(link)
        return link

    async def take(self, report: Callable[[], None]) -> None:
        """Call `report` while no other run reports, then wait for three times as long as it took,
        so that reports take a quarter of the runner's time at most."""
        async with self._turn:
            began = time.perf_counter()
            report()
            await anyio.sleep(_REST * (time.perf_counter() - began))


class _EngineConfig(msgspec.Struct, frozen=True):
    """The configuration of a simulated engine."""

    facts: EngineFacts
    script: str
    behaviours: BehaviourFolder | None
    led: frozenset[str] = frozenset()


class SimulatedLink:
    """The link to a simulated engine in another process."""

    simulated: Final = True
    pauses: Final = True

    def __init__(
        self,
        made: _EngineConfig,
        clock_us: Callable[[], int],
        take: Callable[[Callable[[], None]], Awaitable[None]],
    ) -> None:
        self._made = made
        self._clock_us = clock_us
        self._take = take
        self._incarnation = secrets.token_hex(8)
        self._subscribers = Listeners[Report]()
        self._numbers = itertools.count(1)
        self._asked: dict[int, asyncio.Future[Any]] = {}
        self._writer: asyncio.StreamWriter | None = None
        self._reading: asyncio.Task[None] | None = None
        self._process: Any = None
        self._state: EngineState = "answering"
        self._why = ""

    @property
    def standing(self) -> Standing:
        """The condition of the engine: answering until it has crashed or hangs, or its process has
        ended."""
        if self._why:
            return Standing(state=self._state, why=self._why, incarnation=self._incarnation)
        return Standing(
            state="answering",
            incarnation=self._incarnation,
            generation="current",
            servers=1,
            indexes=False,
        )

    @property
    def is_alive(self) -> bool:
        """True while the simulated engine has a process."""
        return self._process is not None and self._state != "gone"

    @property
    def has_behaviours(self) -> bool:
        """True when actions of the engine may be processes of their own."""
        return self._made.behaviours is not None

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Call `leaves` and start the graph in `order` now; the first start also starts the
        process. Raise NotSent if the process cannot take the start, EngineRefused if the engine
        refuses it."""
        leaves()
        with anyio.CancelScope(shield=True):  # so that a Stop that comes meanwhile finds an engine
            if self._process is None and not self._why:
                await self._begin()
            await self._request("start", order)

    async def take_up(self, order: Order, course: LedCourse) -> None:
        """Begin the process, and bring the graph in `order` to the point that an earlier engine had
        reached by the events in `course`. Only the calls that are still open are reported. Raise
        NotSent if the process cannot take it, EngineRefused if the engine refuses the graph."""
        with anyio.CancelScope(shield=True):
            await self._begin()
            await self._request("take_up", order, course)

    async def returned(self, returned: Returned) -> None:
        """Give the engine the end (outcome and outputs) of a call that a robot carried out. Raise
        NotSent if the process has ended."""
        await self._request("returned", returned)

    async def play(self, number: int) -> None:
        """Send the engine the command to play the call with this number itself. Do not wait for its
        effect."""
        self._say(next(self._numbers), "play", number)

    async def stop(self, graph_name: str) -> None:
        """Send the engine the command to stop a graph. Do not wait for its effect."""
        self._say(next(self._numbers), "stop", graph_name)

    async def pause(self, graph_name: str) -> None:
        """Send the engine the command to pause a graph. Do not wait for its effect."""
        self._say(next(self._numbers), "pause", graph_name)

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Send the engine the command to resume a paused graph. `continue_from`: the full name of
        an action that is started then, "" for none. Do not wait for its effect."""
        leaves()
        self._say(next(self._numbers), "resume", graph_name, continue_from)

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Replace a running graph by the one in `order` now. `continue_from`: the full name of an
        action that is started then, "" for none. Raise NotSent if the process cannot take the
        change, EngineRefused if the engine refuses it."""
        leaves()
        await self._request("modify", order, continue_from)

    async def get(self) -> Answer:
        """Return all graphs that the engine holds now. Raise NoAnswer if the engine or its process
        has ended, or hangs."""
        if self._process is None and not self._why:  # nothing was started yet
            at = self._clock_us()
            return Answer(asked_at=at, at=at, incarnation=self._incarnation, graphs=())
        asked_at = self._clock_us()
        try:
            found: Answer = await self._request("get")
        except NotSent as gone:
            raise NoAnswer(str(gone)) from gone
        return msgspec.structs.replace(found, asked_at=asked_at, incarnation=self._incarnation)

    async def run(self) -> None:
        """Wait until cancelled: the process of the engine needs no help."""
        await anyio.sleep_forever()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` is called with every report of the engine."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """End the engine and its process. An engine with behaviours gets 4 s to end them and itself."""
        if self.has_behaviours and self._process is not None and self._writer is not None:
            self._why = self._why or _GONE
            self._writer.close()
            with anyio.CancelScope(shield=True):
                await to_thread.run_sync(self._process.join, _ENDING_S)
        self._end(_GONE)
        if self._reading is not None:
            self._reading.cancel()

    async def _begin(self) -> None:
        ours, theirs = socket.socketpair()
        theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING)
        try:
            with anyio.fail_after(_START_S):
                self._process = await to_thread.run_sync(
                    _born, theirs, self._made, abandon_on_cancel=True
                )
        except (OSError, EOFError, TimeoutError) as error:
            ours.close()
            self._end(f"No process could be begun for the simulated engine: {error!r}.")
            raise NotSent(self._why) from error
        reader, self._writer = await asyncio.open_connection(sock=ours, limit=_WAITING)
        self._reading = asyncio.create_task(self._read(reader))

    async def _request(self, command: str, *args: Any) -> Any:
        """Send a command and return the engine's answer. Raise NotSent if its process does not run;
        raise EngineRefused or NoAnswer as the engine in the process does."""
        number = next(self._numbers)
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._asked[number] = future
        try:
            if not self._say(number, command, *args):
                raise NotSent(self._why or _GONE)
            return await future
        finally:
            self._asked.pop(number, None)

    def _say(self, number: int, command: str, *args: Any) -> bool:
        if self._writer is None or self._why:
            return False
        self._writer.write(_framed((number, command, args)))
        return True

    async def _read(self, reader: asyncio.StreamReader) -> None:
        """Read answers and reports of the process from its socket until it has ended, and pass them
        on."""
        try:
            while True:
                size = int.from_bytes(await reader.readexactly(_HEAD), "big")
                number, said = pickle.loads(await reader.readexactly(size))
                if number:
                    self._answer(number, said)
                else:
                    await self._take(partial(self._hear, said))
        except (asyncio.IncompleteReadError, OSError):
            ended_by_us = bool(self._why)
            self._end(_DIED)
            if self._process is not None and not ended_by_us:
                await to_thread.run_sync(self._process.join, _ENDING_S)
                cause = cause_of_end(self._process.exitcode)
                log.error("the process of a simulated engine has died (%s)", cause)

    def _answer(self, number: int, said: Any) -> None:
        future = self._asked.get(number)
        if future is None or future.done():
            return
        if isinstance(said, Exception):
            future.set_exception(said)
        else:
            future.set_result(said)

    def _hear(self, report: Report) -> None:
        if isinstance(report, EngineChanged):
            self._state, self._why = report.state, report.why
        self._subscribers.tell(report)

    def _end(self, why: str) -> None:
        """Mark the engine as gone for the reason `why`, kill its process, and fail all calls that
        wait for an answer. If its process died, report that to listeners."""
        was, self._state = self._state, "gone"
        fresh, self._why = not self._why, self._why or why
        if self._writer is not None:
            self._writer.close()
        if self._process is not None and self._process.is_alive():
            self._process.kill()
        for future in self._asked.values():
            if not future.done():
                future.set_exception(NoAnswer(self._why))
        if why == _DIED and (fresh or was != "gone"):
            self._subscribers.tell(EngineChanged(at=self._clock_us(), state="gone", why=self._why))


def _born(theirs: socket.socket, made: _EngineConfig) -> Any:
    with theirs:
        return child(_live, theirs, made, name="simulated engine", nice=0 if made.led else _NICE)


def _framed(value: object) -> bytes:
    raw = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    return len(raw).to_bytes(_HEAD, "big") + raw


# --- in the process -------------------------------------------------------------------------------


def _live(wire: socket.socket, made: _EngineConfig) -> None:
    """Run one simulated engine in this process until the runner closes its end of the socket
    `wire`. `made`: the configuration of the engine."""
    performer: BehaviourPerformer | LedCalls | None = LedCalls(made.led) if made.led else None
    if made.behaviours is not None:
        bound_address_space()
        performer = BehaviourPerformer(made.behaviours)
    try:
        with suppress(asyncio.IncompleteReadError, ConnectionError, BrokenPipeError):
            anyio.run(_serve, wire, made, performer)
    finally:
        if performer is not None:
            performer.end()


async def _serve(
    wire: socket.socket, made: _EngineConfig, performer: BehaviourPerformer | LedCalls | None
) -> None:
    reader, writer = await asyncio.open_connection(sock=wire)
    writer.transport.set_write_buffer_limits(high=_WAITING)
    engine = engine_of(made.facts, made.script, performer)
    link = SimulatorLink(engine, clock_us=utc_us, performer=performer)
    if isinstance(performer, BehaviourPerformer):
        loop = asyncio.get_running_loop()
        performer.wake = partial(_woken, loop, link)

    def hear(report: Report) -> None:
        for part in _parts(report):
            writer.write(_framed((0, part)))

    async def live() -> None:
        """Run the engine no faster than the runner reads, so that unread output is bounded."""
        await link.run(writer.drain)

    async def obey() -> None:
        with suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                size = int.from_bytes(await reader.readexactly(_HEAD), "big")
                number, command, args = pickle.loads(await reader.readexactly(size))
                writer.write(_framed((number, await _obeyed(link, command, args))))
        tasks.cancel()

    with link.listen(hear):
        async with anyio.create_task_group() as group:
            tasks = group.cancel_scope
            group.start_soon(live)
            group.start_soon(obey)


def _woken(loop: asyncio.AbstractEventLoop, link: SimulatorLink) -> None:
    """Wake the simulated engine of `link` from the thread of a behaviour whose call has ended.
    `loop`: the event loop of the engine."""
    with suppress(RuntimeError):  # the loop has ended, and the engine with it
        loop.call_soon_threadsafe(link.wake)


async def _obeyed(link: SimulatorLink, command: str, args: tuple[Any, ...]) -> object:
    assert command in _COMMANDS
    try:
        return await getattr(link, command)(*args)
    except (EngineRefused, NotSent, NoAnswer) as error:
        return error


def _parts(report: Report) -> Iterator[Report]:
    """Yield a report in parts of at most 100 changes, so that none keeps the runner busy for long."""
    if not isinstance(report, Transitions):
        yield report
        return
    for start in range(0, len(report.changes), _CHANGES):
        yield Transitions(run=report.run, changes=report.changes[start : start + _CHANGES])
