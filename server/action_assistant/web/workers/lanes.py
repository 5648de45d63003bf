"""Worker processes: whatever may take long happens in them, so that the event loop stays free.

A thread would not do: it shares the interpreter lock with the loop. Workers are forked by the fork
server of `multiprocessing`, which begins before this process has threads, data or sockets
(`start_fork_server`), so they hold nothing of ours, no rclpy, no locks of its threads, and a new one
is there within milliseconds. What is asked of them has to be a function of a module, with values
that can be pickled.
"""

import asyncio
import contextlib
import gc
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from functools import cache
from multiprocessing import resource_tracker, util
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from action_assistant.errors import TooLarge, TooMany, Unavailable
from action_assistant.logs import set_up_worker
from action_assistant.safe_text import make_streams_printable
from action_assistant.system import posix
from action_assistant.web.auth.caller import Caller, caller

if TYPE_CHECKING:  # not on Windows
    from multiprocessing.context import ForkServerContext, ForkServerProcess

__all__ = [
    "HOPELESS",
    "Crashed",
    "GaveUp",
    "Lane",
    "OutOfTime",
    "RunInWorker",
    "child",
    "opened",
    "run_here",
    "start_fork_server",
]

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

_MEMORY: Final = 768 << 20  # bytes that a worker may take beyond what it begins with
_TIRED: Final = 256 << 20  # bytes in use after which a worker makes room for a fresh one
_MORE: Final = b"+"
LAST: Final = b"."  # this worker does nothing more
_WAITING: Final = 32  # requests of one person
_ALL_WAITING: Final = 256
_START_S: Final = 30.0
_IDLE_S: Final = 300.0  # without work, after which a worker is ended
_ENDING_S: Final = 5.0  # for which a process whose wire is closed may still be ending
_ORPHANED: Final = 64  # exit code of a process whose parent has ended
_DIED: Final = "The process that worked on this has died; nothing came of it."


@cache
def _context() -> "ForkServerContext":
    """Return the context that forks workers from a process without other state. It does not exist
    on Windows."""
    return multiprocessing.get_context("forkserver")


def start_fork_server(preloaded: Sequence[str]) -> None:
    """Fork the process that will fork the workers, with the modules that this process has imported.

    A fork server that is started as a new interpreter imports them again, for 1.5 s of a processor.
    To be called after the imports and before this process has threads, data or sockets. Where
    forking is not safe, the first worker starts a new interpreter, as it does when the fork server
    dies.
    """
    if sys.platform != "linux" or _threads() > 1:
        return
    from multiprocessing import forkserver  # not on Windows

    resource_tracker.ensure_running()  # a process of its own, in a new interpreter
    _context().set_forkserver_preload(list(preloaded))
    started_anew = util.spawnv_passfds
    util.spawnv_passfds = _forked
    try:
        forkserver.ensure_running()
    finally:
        util.spawnv_passfds = started_anew


def _threads() -> int:
    """Return the number of threads of this process, also of those that Python did not start."""
    try:
        return len(os.listdir("/proc/self/task"))  # noqa: PTH208 - counted, not visited
    except OSError:
        return threading.active_count()


def _forked(path: bytes, args: Sequence[Any], passfds: Sequence[int]) -> int:
    """Do in a fork of this process what the interpreter at `path` would do for `-c` among `args`,
    with no files of this process but `passfds` and the standard ones. Return the number of the
    process."""
    gc.collect()
    gc.freeze()  # in this process, too: its garbage collector writes to no page that both share
    process = os.fork()
    if process:
        return process
    try:
        _let_go_of_files(passfds)
        gc.enable()
        exec(args[-1], {})  # a line that `multiprocessing` writes
    except SystemExit:
        os._exit(0)  # no client is left
    except BaseException:  # noqa: BLE001 - nothing of this process may go on here
        traceback.print_exc()
    finally:
        os._exit(1)


def _let_go_of_files(kept: Sequence[int]) -> None:
    """Put the null device in the place of each open file but the standard ones and those in `kept`.

    A descriptor that is closed is given out again, for example for the wire of a worker; an object
    that still believes to own it would close that.
    """
    nothing = os.open(os.devnull, os.O_RDWR)
    for name in os.listdir("/proc/self/fd"):  # noqa: PTH208 - numbers, no paths
        if int(name) > 2 and int(name) not in (*kept, nothing):
            os.dup2(nothing, int(name), inheritable=False)
    os.close(nothing)


def wire() -> tuple[Connection, Connection]:
    """Return the two ends of a pipe: that of this process and that of the worker."""
    ours, theirs = _context().Pipe()
    return ours, theirs


def child(
    work: Callable[..., None], *args: Any, name: str, nice: int, preloaded: Sequence[str]
) -> "ForkServerProcess":
    """Start a process named `name` that runs `work(*args)` and ends with this one; wait until it
    exists. `nice`: how much lower its priority is; `preloaded`: modules that the fork server
    imports before the first fork. Raise OSError or EOFError if it cannot be started."""
    _context().set_forkserver_preload(list(preloaded))
    told = (name, work, args, nice)
    process = _context().Process(target=_run_in_child, args=told, name=name, daemon=True)
    process.start()
    return process


def _run_in_child(name: str, work: Callable[..., None], args: tuple[Any, ...], nice: int) -> None:
    """Set up the new process `name` and call `work` in it. When processor time runs short, other
    processes go first (`nice`); when memory runs short, the system ends this process first."""
    make_streams_printable()
    set_up_worker(name)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # meant for our parent, which ends us
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(OSError):
        os.nice(nice)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    with contextlib.suppress(OSError, ValueError):
        posix.bound_memory(_MEMORY)
    gc.freeze()
    work(*args)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(_ORPHANED)


def serve(wire: Connection) -> None:
    """Run the functions that come as requests on the pipe `wire`, one after the other, and send
    back their results, until the parent closes the pipe."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            wire.send_bytes(_reply(wire.recv_bytes()))


def _reply(request: bytes) -> bytes:
    try:
        work, args = pickle.loads(request)
        reply = pickle.dumps(("returned", work(*args)), pickle.HIGHEST_PROTOCOL)
    except MemoryError:
        large = TooLarge("This takes more memory than one request may have.")
        return LAST + pickle.dumps(("raised", large))
    except Exception as error:  # noqa: BLE001 - it is raised where it was asked for
        reply = _raised(error)
    return (LAST if posix.memory_in_use() > _TIRED else _MORE) + reply


def _raised(error: Exception) -> bytes:
    """Return a reply with an error, or with its text if it cannot be pickled."""
    try:
        reply = pickle.dumps(("raised", error))
        pickle.loads(reply)
    except Exception:
        logging.getLogger(__name__).exception("a worker cannot say what went wrong")
        reply = pickle.dumps(("raised", RuntimeError(repr(error)[:2000])))
    return reply


class RunInWorker(Protocol):
    """Runs a function in another process, so that the event loop stays free for Stop and for other
    people.

    The function must belong to a module; its arguments and result must be picklable.
    """

    def __call__(self, work: Callable[..., T], /, *args: Any) -> Awaitable[T]:
        """Return the result of `work(*args)`, computed in another process."""
        ...


async def run_here(work: Callable[..., T], /, *args: Any) -> T:
    """Return the result of `work(*args)`, computed in this process and not in a worker."""
    return work(*args)


class Crashed(Unavailable):
    """The worker process died before it answered."""

    title = "What would have worked on this has died"


class OutOfTime(Crashed):
    """The worker process used up its processor time before it answered."""

    title = "What would have worked on this had no processor time left"


class GaveUp(Unavailable):
    """The work took longer than the lane waits, so its worker was killed."""

    @property
    def type(self) -> str:
        """The type of the problem for programs: that of Unavailable, as for other faults of
        workers."""
        return "unavailable"


#: Errors of the work itself: a second attempt would fail as well.
HOPELESS: Final = (Crashed, GaveUp, TooLarge)


class Lane:
    """A pool of worker processes with a queue: first come, first served, one request of each person
    at a time.

    `await lane(function, *values)` runs a function. The worker is killed if the client leaves, or
    after `patience` seconds.
    """

    def __init__(
        self,
        name: str,
        processes: int,
        patience: float,
        nice: int,
        threads: CapacityLimiter,
        preloaded: Sequence[str],
    ) -> None:
        self._name = name
        self._nice = nice
        self._preloaded = preloaded
        self._patience = patience
        self._threads = threads
        self._idle: list[_Worker] = []
        self._busy: set[_Worker] = set()
        self._free = anyio.Semaphore(processes)
        self.deaths = 0  # of workers, while they worked on something
        self.given_up = 0  # what took longer than `patience`
        self._turns: dict[str, anyio.Lock] = {}
        self._waiting: dict[str, int] = {}
        self._closed = False

    async def __call__(self, work: Callable[..., T], /, *args: Any) -> T:
        """Return the result of `work(*args)`, run in a worker. Raise the exception of `work`;
        TooMany if the queue is full; TooLarge if it needs too much memory; Unavailable if the
        client leaves, or the worker dies or takes too long."""
        asking = caller()
        request = pickle.dumps((work, args), pickle.HIGHEST_PROTOCOL)
        with self._queued(asking.person if asking is not None else "") as turn:
            reply, gone = b"", False
            failed: Exception | None = None
            async with anyio.create_task_group() as tasks:

                async def leave(asking: Caller) -> None:
                    nonlocal gone
                    await asking.gone()
                    gone = True
                    tasks.cancel_scope.cancel()

                if asking is not None:
                    tasks.start_soon(leave, asking)
                try:
                    async with turn, self._free:
                        reply = await self._done(request)
                except Exception as error:  # noqa: BLE001 - raised below, outside of the group
                    failed = error
                tasks.cancel_scope.cancel()
        if gone:
            raise Unavailable("Whoever asked for this has gone.")
        if failed is not None:
            raise failed
        kind, value = pickle.loads(memoryview(reply)[1:])
        if kind == "raised":
            raise value
        outcome: T = value
        return outcome

    @contextmanager
    def _queued(self, person: str) -> Iterator[anyio.Lock]:
        """Return a context during which a request of this person counts as waiting; its value is
        the lock of the person's requests. Raise TooMany if too many requests of this person or of
        all people wait; one without a person ("") is always taken."""
        waiting = self._waiting.get(person, 0)
        if person and (waiting >= _WAITING or sum(self._waiting.values()) >= _ALL_WAITING):
            raise TooMany("Too much waits to be worked on already; wait some seconds.")
        self._waiting[person] = waiting + 1
        try:
            yield self._turns.setdefault(person, anyio.Lock())
        finally:
            self._waiting[person] -= 1
            if not self._waiting[person]:
                del self._waiting[person], self._turns[person]

    async def _done(self, request: bytes) -> bytes:
        """Send a request to a worker and return the reply. Raise Crashed or OutOfTime if the worker
        dies, GaveUp after `patience` seconds. If a worker was dead before it had read the request,
        try one more."""
        reply = await self._done_by_worker(request)
        if reply is None and not self._closed:
            reply = await self._done_by_worker(request)
        if reply is None:
            raise Crashed(_DIED)
        return reply

    async def _done_by_worker(self, request: bytes) -> bytes | None:
        """Send a request to one worker and return the reply; None if the worker was dead before it
        had read the request. Raise what `_done` raises."""
        self._idle = [each for each in self._idle if each.lives]
        worker = self._idle.pop() if self._idle else await self._hired()
        self._busy.add(worker)
        finished = False
        try:
            with anyio.fail_after(self._patience):
                reply = await to_thread.run_sync(
                    worker.asked, request, abandon_on_cancel=True, limiter=self._threads
                )
            finished = reply[:1] != LAST
        except TimeoutError as late:
            self.given_up += 1
            raise GaveUp(
                f"This took longer than {self._patience:.0f} s and was given up."
            ) from late
        except (OSError, EOFError) as error:
            self.deaths += 1
            code = await to_thread.run_sync(worker.ended, limiter=self._threads)
            log.error("%s: a worker has died (%s)", self._name, posix.cause_of_end(code))
            if isinstance(error, (BrokenPipeError, ConnectionResetError)):
                return None
            if code == -signal.SIGPROF:
                raise OutOfTime("The process that worked on this took too long.") from error
            raise Crashed(_DIED) from error
        finally:
            self._busy.discard(worker)
            if finished:
                worker.used_at = time.monotonic()
                self._idle.append(worker)
            else:
                worker.kill()
        return reply

    @property
    def name(self) -> str:
        """The name of the pool, for people and metrics."""
        return self._name

    @property
    def busy(self) -> int:
        """The number of workers that are working on a request."""
        return len(self._busy)

    @property
    def waiting(self) -> int:
        """The number of requests without an answer, including the ones that are worked on."""
        return sum(self._waiting.values())

    def retire(self, before: float) -> None:
        """End the workers that have had nothing to do since `before`, by the monotonic clock."""
        for worker in [each for each in self._idle if each.used_at < before]:
            self._idle.remove(worker)
            worker.kill()

    async def _hired(self) -> "_Worker":
        try:
            with anyio.fail_after(_START_S):
                return await to_thread.run_sync(
                    _Worker.born,
                    self._name,
                    self._nice,
                    self._preloaded,
                    abandon_on_cancel=True,
                    limiter=self._threads,
                )
        except (ConnectionError, EOFError) as error:  # before it had been told what to do
            self.deaths += 1
            raise Crashed(_DIED) from error
        except (OSError, TimeoutError) as error:
            raise Crashed(f"No process can be started to work on this: {error!r}.") from error

    def close(self) -> None:
        """Kill all worker processes of the pool."""
        self._closed = True
        for worker in (*self._idle, *self._busy):
            worker.kill()
        self._idle.clear()


@asynccontextmanager
async def opened(*lanes: Lane) -> AsyncIterator[None]:
    """Return a context in which pools make workers as they need them, and end those that had
    nothing to do for some minutes. All workers are killed at its end."""
    retiring = asyncio.create_task(_retire_idle(lanes))
    try:
        yield
    finally:
        retiring.cancel()
        await asyncio.wait([retiring])
        for lane in lanes:
            lane.close()


async def _retire_idle(lanes: Sequence[Lane]) -> None:
    while True:
        await anyio.sleep(_IDLE_S / 5)
        for lane in lanes:
            lane.retire(time.monotonic() - _IDLE_S)


class _Worker:
    """A worker process, as its parent sees it: answers one request at a time."""

    def __init__(self, process: "ForkServerProcess", wire: Connection) -> None:
        self._process = process
        self._wire = wire
        self.used_at = time.monotonic()  # when it was born, or answered last

    @classmethod
    def born(cls, name: str, nice: int, preloaded: Sequence[str]) -> "_Worker":
        """Start a worker process named `name`, and wait until it exists: milliseconds, longer for
        the first one. `nice`: how much lower its priority is; `preloaded`: modules that the fork
        server imports before the first fork."""
        ours, theirs = wire()
        process = child(serve, theirs, name=name, nice=nice, preloaded=preloaded)
        theirs.close()
        return cls(process, ours)

    @property
    def lives(self) -> bool:
        """Return whether the process is alive; it may have died, for example for want of memory."""
        return self._process.is_alive()

    def asked(self, request: bytes) -> bytes:
        """Send one request and return the reply. Raise BrokenPipeError or ConnectionResetError if
        the process was dead before it had read the request, another OSError or EOFError if it died
        afterwards."""
        self._wire.send_bytes(request)
        return self._wire.recv_bytes()

    def ended(self) -> int | None:
        """Return the exit code of the dead process, or minus its signal; None if it is still ending
        after some seconds."""
        self._process.join(_ENDING_S)
        return self._process.exitcode

    def kill(self) -> None:
        """Kill the process. A thread that waits for its reply gets an error at once."""
        if self._process.is_alive():  # a number that has been given back may be somebody else's
            self._process.kill()
        # Its thread may still read from the wire: that ends by itself, since the other end is closed.
