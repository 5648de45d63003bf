"""The threads that an engine began since the start of one run, as this computer's kernel shows them.

The engine's node loads and runs each action in a thread of its own, which the action before it or the
start begins, and each thread of the engine ends by itself. So once none is left that began since the
start was handed over, no code of the run goes on, and none of it can begin. The answers of an engine
show neither an action that loads nor the thread of one that it has given up as ERROR.
"""

from collections.abc import Callable
from typing import Final

from action_assistant.runner.links.engine_process import EngineProcess, Thread, threads

_SCANS: Final = 2  # since the threads are not listed at one moment
#: The node begins one thread to wait for the graph, and one for each action.
_OF_A_RUN: Final = 2

ThreadsOf = Callable[[EngineProcess], frozenset[Thread] | None]


class EngineThreads:
    """Compares the threads of an engine's process with those before the start of a run.

    It concludes nothing if the process is not visible from here, or if two threads of this run were
    never seen while an action moved: a single one only waits for the graph.
    """

    def __init__(self, threads_of: ThreadsOf = threads) -> None:
        self._threads_of = threads_of
        self._process: EngineProcess | None = None
        self._before: frozenset[Thread] | None = None
        self._was_seen = False

    def starts(self, process: EngineProcess | None) -> None:
        """Store which threads the process has, right before the start is sent. `process`: None if
        it cannot be observed."""
        self._process = process
        self._before = None if process is None else self._threads_of(process)
        self._was_seen = False

    def see_moving(self) -> None:
        """List the threads of the process while an answer shows an action moving, to make sure that
        the threads of the run can be seen."""
        if not self._was_seen and self._before is not None:
            self._was_seen = len(self._since_the_start() or ()) >= _OF_A_RUN

    def have_ended(self, process: EngineProcess | None) -> bool:
        """Return whether all threads that began since the start have ended, in the process that the
        run was sent to. False if that cannot be observed."""
        if not self._was_seen or process is None or process != self._process:
            return False
        return all(self._since_the_start() == frozenset() for _ in range(_SCANS))

    def _since_the_start(self) -> frozenset[Thread] | None:
        if self._process is None or self._before is None:
            return None
        now = self._threads_of(self._process)
        return None if now is None else now - self._before
