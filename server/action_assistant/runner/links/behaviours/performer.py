"""The performer that an engine gives the calls of its behaviours to; whoever drives the engine collects the
results with `taken`."""

import ctypes
import logging
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from action_assistant.runner.links.behaviours.call_process import CallProcess
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.umrf.model import Action, Precondition
from action_assistant.umrf.semantics import Call, Returned

log: Final = logging.getLogger(__name__)

#: Calls at a time in one engine; each takes two processes.
MOST: Final = 32
_ENDING_S: Final = 3.0
_GIVEN_UP: Final = "It went on for 5 s after a stop, and was killed."
_OVER: Final = "The engine has ended."


_STACK: Final = 1 << 20  # bytes
_ARENA_MAX: Final = -8  # M_ARENA_MAX of glibc


def bound_address_space() -> None:
    """Save address space: threads get small stacks and share one heap (glibc would reserve 64 MB
    for each thread)."""
    threading.stack_size(_STACK)
    if mallopt := getattr(ctypes.CDLL(None), "mallopt", None):
        mallopt(_ARENA_MAX, 1)


class BehaviourPerformer:
    """Runs the calls of behaviours for one simulated engine, each in a process of its own. `wake`
    is called on another thread when a call has ended. A call is named by its number."""

    takes_graphs = False

    def __init__(self, folder: BehaviourFolder, wake: Callable[[], None] = lambda: None) -> None:
        self.wake = wake
        self._folder = folder
        self._calls: dict[int, CallProcess] = {}
        self._given_up: set[int] = set()
        self._returned: list[Returned] = []
        self._lock = threading.Lock()

    @property
    def is_killing(self) -> bool:
        """True while a killed call may still run."""
        with self._lock:
            return bool(self._given_up)

    def performs(self, action: Action, *, inside: bool) -> bool:
        """Return whether an action is played by a behaviour: a file for its name exists, even if it
        could not be run. `inside`: the action is in a sub-graph, which makes no difference here."""
        return self._folder.has(action.name)

    def begin(self, call: Call) -> None:
        """Start the process of a call, on a thread of its own. A call that cannot be started ends with an error."""
        with self._lock:
            going = len(self._calls)
        why = f"{MOST} behaviours run already."
        if going < MOST:
            try:
                process = CallProcess(self._folder, call, self._end)
                with self._lock:
                    self._calls[call.number] = process
                process.begin()
                return
            except (OSError, RuntimeError) as failed:  # no file or no thread can be had
                why = f"The behaviour could not be begun: {failed}."
        self._end(Returned(number=call.number, result="on_error", message=why))

    def stop(self, number: int) -> None:
        """Ask the call `number` to stop, without waiting; it has the 5 s that the engine waits."""
        self._tell(number, "stop")

    def pause(self, number: int) -> None:
        """Ask the call `number` to pause, without waiting: its `sleep` then lasts until it is
        resumed."""
        self._tell(number, "pause")

    def resume(self, number: int) -> None:
        """Let the paused call `number` go on, without waiting."""
        self._tell(number, "resume")

    def give_up(self, number: int) -> str | None:
        """Kill the call `number`, without waiting; return its messages so far, None if it has ended
        already."""
        with self._lock:
            process = self._calls.get(number)
            if process is None:
                return None
            self._given_up.add(number)
        return process.kill(_GIVEN_UP)

    def ended(self, number: int, result: Precondition, outputs: Mapping[str, Any]) -> None:
        """Do nothing: no call of a behaviour is given back to the script."""

    def taken(self) -> list[Returned]:
        """Return the results of the calls that have ended since the last time."""
        with self._lock:
            taken, self._returned = self._returned, []
            self._given_up -= {each.number for each in taken}
        return taken

    @property
    def is_busy(self) -> bool:
        """True while a call runs, or `taken` would return a result."""
        with self._lock:
            return bool(self._calls or self._returned)

    @property
    def has_returned(self) -> bool:
        """True while `taken` would return a result."""
        return bool(self._returned)

    def kill_all(self) -> list[CallProcess]:
        """Kill all calls without waiting for their end; return the ones that were running."""
        with self._lock:
            going = list(self._calls.values())
        for process in going:
            process.kill(_OVER)
        return going

    def end(self) -> None:
        """Kill all calls and wait for their end, 3 s at most."""
        deadline = time.monotonic() + _ENDING_S
        for process in self.kill_all():
            if not process.wait(max(0.0, deadline - time.monotonic())):
                log.error("a behaviour goes on that cannot be killed")

    def _tell(self, number: int, command: str) -> None:
        with self._lock:
            process = self._calls.get(number)
        if process is not None:
            process.tell(command)

    def _end(self, returned: Returned) -> None:
        """Store the result of a call that has ended, and call `wake`. Mostly called on the thread
        of that call."""
        with self._lock:
            self._calls.pop(returned.number, None)
            self._returned.append(returned)
        self.wake()
