"""The open runs, as the review needs them."""

from collections.abc import Callable, Mapping
from typing import Final, Protocol

import anyio

from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.recorder import RunRecorder
from action_assistant.runner.runs.run import Run

_SETTLED_S: Final = 2.0  # after which a question is answered from what is stored


class OngoingRun(Protocol):
    """An open run, and the recorder of its events."""

    run: Run
    recorder: RunRecorder


class OngoingRuns(Protocol):
    """The part of `ExecutionService` that the review uses: open runs, and reading stored ones."""

    history: RunHistory

    @property
    def open(self) -> Mapping[str, OngoingRun]:
        """The open runs by id."""
        ...

    def next_number(self) -> int:
        """Return a new run number."""
        ...

    def watch(self, watcher: Callable[[OngoingRun], None]) -> None:
        """Call `watcher` with every run that has changed, at once."""
        ...


async def wait_until_stored(opened: OngoingRun) -> None:
    """Wait until the events of a run that were shown are stored, for two seconds at most."""
    with anyio.move_on_after(_SETTLED_S):
        await opened.recorder.flushed()
