"""Worker processes: whatever may take long happens in them, so that the event loop stays free.

A thread would not do: it shares the interpreter lock with the loop. Workers are forked by a server
process that `multiprocessing` starts afresh, so they hold nothing of ours, no rclpy, no locks of its
threads, and a new one is there within milliseconds. What is asked of them has to be a function of a
module, with values that can be pickled.
"""

import asyncio
import contextlib
import gc
import logging
import multiprocessing
import os
import pickle
import resource
import signal
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from action_assistant.errors import TooLarge, TooMany, Unavailable
from action_assistant.plain import make_streams_plain
from action_assistant.web.access import Caller, caller

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

_MEMORY: Final = 768 << 20  # bytes that a worker may take beyond what it begins with
_TIRED: Final = 256 << 20  # bytes in use after which a worker makes room for a fresh one
_WAITING: Final = 32  # requests of one person
_ALL_WAITING: Final = 256
_START_S: Final = 30.0

_context: Final = multiprocessing.get_context("forkserver")


class Aside(Protocol):
    """A way to do work that takes long without holding up a Stop, or other people: in another
    process, so that it is a function of a module, and what it is given and returns are values."""

    def __call__(self, work: Callable[..., T], /, *args: Any) -> Awaitable[T]:
        """The outcome of `work(*args)`."""
        ...


async def here(work: Callable[..., T], /, *args: Any) -> T:
    """No way aside: the work is done at once, in this process."""
    return work(*args)


class Crashed(Unavailable):
    """What would have worked on this has died"""


class Lane:
    """Some workers, and who waits for them: in the order they came, of each person one at a time.

    Calling it is the way to have something done: `await lane(function, *values)`. Nothing of it
    outlives whoever asked: when they have gone, or after `patience` seconds, the worker is killed.
    """

    def __init__(
        self,
        name: str,
        hands: int,
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
        self._free = anyio.Semaphore(hands)
        self._turns: dict[str, anyio.Lock] = {}
        self._waiting: dict[str, int] = {}

    async def __call__(self, work: Callable[..., T], /, *args: Any) -> T:
        """The outcome of `work(*args)`. Raises what it raises, Unavailable, TooLarge, TooMany."""
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
        kind, value = pickle.loads(reply[1:])
        if kind == "raised":
            raise value
        outcome: T = value
        return outcome

    @contextmanager
    def _queued(self, person: str) -> Iterator[anyio.Lock]:
        """A place in the queue. Raises TooMany."""
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
        """The reply of the worker. Raises Crashed, Unavailable."""
        self._idle = [each for each in self._idle if each.lives]
        worker = self._idle.pop() if self._idle else await self._hired()
        self._busy.add(worker)
        finished = False
        try:
            with anyio.fail_after(self._patience):
                reply = await to_thread.run_sync(
                    worker.asked, request, abandon_on_cancel=True, limiter=self._threads
                )
            finished = reply[:1] != _LAST
        except TimeoutError as late:
            raise Unavailable(
                f"This took longer than {self._patience:.0f} s and was given up."
            ) from late
        except (OSError, EOFError) as error:
            log.error("%s: a worker has died (%r)", self._name, error)
            raise Crashed(
                "The process that worked on this has died; nothing came of it."
            ) from error
        finally:
            self._busy.discard(worker)
            if finished:
                self._idle.append(worker)
            else:
                worker.kill()
        return reply

    async def warm(self) -> None:
        """Have a worker ready."""
        if not self._idle and not self._busy:
            self._idle.append(await self._hired())

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
        except (OSError, EOFError, TimeoutError) as error:
            raise Crashed(f"No process can be started to work on this: {error!r}.") from error

    def close(self) -> None:
        """Let all of them go."""
        for worker in (*self._idle, *self._busy):
            worker.kill()
        self._idle.clear()


@asynccontextmanager
async def kept_warm(*lanes: Lane) -> AsyncIterator[None]:
    """Workers for these lanes, as long as you are inside. The first ones are made meanwhile."""
    tasks = [asyncio.create_task(_keep_warm(lane)) for lane in lanes]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
        for lane in lanes:
            lane.close()


async def _keep_warm(lane: Lane) -> None:
    """Whoever comes next shall not have to wait for a worker to be made."""
    while True:
        try:
            await lane.warm()
        except Crashed as error:
            log.error("%s", error.detail)
        await anyio.sleep(0.5)


class _Worker:
    """A process, as whoever asks it sees it."""

    def __init__(self, process: ForkServerProcess, wire: Connection) -> None:
        self._process = process
        self._wire = wire

    @classmethod
    def born(cls, name: str, nice: int, preloaded: Sequence[str]) -> "_Worker":
        """Start one. Takes milliseconds, but for the first."""
        ours, theirs = _context.Pipe()
        process = child(_work, theirs, name=name, nice=nice, preloaded=preloaded)
        theirs.close()
        return cls(process, ours)

    @property
    def lives(self) -> bool:
        """Whether it has not died meanwhile, for want of memory say."""
        return self._process.is_alive()

    def asked(self, request: bytes) -> bytes:
        """Have one thing done. Raises OSError, EOFError when the process has died."""
        self._wire.send_bytes(request)
        return self._wire.recv_bytes()

    def kill(self) -> None:
        """End it, whatever it does. Who waits for it learns at once."""
        if self._process.is_alive():  # a number that has been given back may be somebody else's
            self._process.kill()
        # Its thread may still read from the wire: that ends by itself, since the other end is closed.


def child(
    work: Callable[..., None], *args: Any, name: str, nice: int, preloaded: Sequence[str]
) -> ForkServerProcess:
    """A process of low priority that ends with this one, in which `work(*args)` runs. Waits for it
    to exist. `preloaded`: the modules that the server process imports before it forks the first one.
    Raises OSError, EOFError."""
    _context.set_forkserver_preload(list(preloaded))
    process = _context.Process(target=_humbly, args=(work, args, nice), name=name, daemon=True)
    process.start()
    return process


def _humbly(work: Callable[..., None], args: tuple[Any, ...], nice: int) -> None:
    """In the process: others first, when time or memory runs short."""
    make_streams_plain()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # meant for our parent, which ends us
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(OSError):
        os.nice(nice)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    with contextlib.suppress(OSError, ValueError):
        limit = _mapped() + _MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    gc.freeze()
    work(*args)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(0)


def _mapped() -> int:
    """Bytes of address space in use."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _in_use() -> int:
    """Bytes of memory in use; 0 where nobody says."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return 0


_MORE: Final = b"+"
_LAST: Final = b"."  # this worker does nothing more


def _work(wire: Connection) -> None:
    """Do one thing after the other, until whoever asks has gone."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            wire.send_bytes(_reply(wire.recv_bytes()))


def _reply(request: bytes) -> bytes:
    try:
        work, args = pickle.loads(request)
        reply = pickle.dumps(("returned", work(*args)), pickle.HIGHEST_PROTOCOL)
    except MemoryError:
        large = TooLarge("This takes more memory than one request may have.")
        return _LAST + pickle.dumps(("raised", large))
    except Exception as error:  # noqa: BLE001 - it is raised where it was asked for
        reply = _raised(error)
    return (_LAST if _in_use() > _TIRED else _MORE) + reply


def _raised(error: Exception) -> bytes:
    """An error that reaches the other side as it is, where that is possible."""
    try:
        reply = pickle.dumps(("raised", error))
        pickle.loads(reply)
    except Exception:
        logging.getLogger(__name__).exception("a worker cannot say what went wrong")
        reply = pickle.dumps(("raised", RuntimeError(repr(error)[:2000])))
    return reply
