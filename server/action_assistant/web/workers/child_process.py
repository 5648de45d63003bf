"""A worker process from within: low priority, bounded memory, one task after the other.

Imports little, since every worker begins with it.
"""

import contextlib
import gc
import logging
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Sequence
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from action_assistant.errors import TooLarge
from action_assistant.logs.setup import set_up_worker
from action_assistant.safe_text import make_streams_printable
from action_assistant.system import limits

if TYPE_CHECKING:  # not on Windows
    from multiprocessing.context import ForkServerContext, ForkServerProcess

_MEMORY: Final = 768 << 20  # bytes that a worker may take beyond what it begins with
_TIRED: Final = 256 << 20  # bytes in use after which a worker makes room for a fresh one


@cache
def _context() -> "ForkServerContext":
    """Return the context that forks workers from a process without other state. It does not exist
    on Windows."""
    return multiprocessing.get_context("forkserver")


def wire() -> tuple[Connection, Connection]:
    """Return the two ends of a pipe: ours and the worker's."""
    ours, theirs = _context().Pipe()
    return ours, theirs


def child(
    work: Callable[..., None], *args: Any, name: str, nice: int, preloaded: Sequence[str]
) -> "ForkServerProcess":
    """Start a process of low priority that runs `work(*args)` and ends with this one. Wait until it
    exists. `preloaded`: modules that the fork server imports before the first fork. Raise
    OSError or EOFError if it cannot be started."""
    _context().set_forkserver_preload(list(preloaded))
    told = (name, work, args, nice)
    process = _context().Process(target=_humbly, args=told, name=name, daemon=True)
    process.start()
    return process


def _humbly(name: str, work: Callable[..., None], args: tuple[Any, ...], nice: int) -> None:
    """Set up the new process and call `work` in it. When processor time runs short, other processes
    go first (`nice`); when memory runs short, the system ends this process first."""
    make_streams_printable()
    set_up_worker(name)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # meant for our parent, which ends us
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(OSError):
        os.nice(nice)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    with contextlib.suppress(OSError, ValueError):
        limits.bound_memory(_MEMORY)
    gc.freeze()
    work(*args)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(0)


_MORE: Final = b"+"
LAST: Final = b"."  # this worker does nothing more


def serve(wire: Connection) -> None:
    """Serve requests one after the other until the parent closes the pipe."""
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
    return (LAST if limits.memory_in_use() > _TIRED else _MORE) + reply


def _raised(error: Exception) -> bytes:
    """Return a reply with an error, or with its text if it cannot be pickled."""
    try:
        reply = pickle.dumps(("raised", error))
        pickle.loads(reply)
    except Exception:
        logging.getLogger(__name__).exception("a worker cannot say what went wrong")
        reply = pickle.dumps(("raised", RuntimeError(repr(error)[:2000])))
    return reply
