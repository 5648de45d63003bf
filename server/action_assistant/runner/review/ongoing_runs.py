"""What looking back needs of what goes on: open runs, and how others are read."""

from collections.abc import Callable, Mapping
from typing import Final, Protocol

import anyio

from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.recorder import RunRecorder
from action_assistant.runner.runs.run import Run

_SETTLED_S: Final = 2.0  # then what is stored is told


class OngoingRun(Protocol):
    """A run that goes on."""

    run: Run
    recorder: RunRecorder


class OngoingRuns(Protocol):
    """What goes on, as far as looking back needs it: open runs, and how others are read."""

    history: RunHistory

    @property
    def open(self) -> Mapping[str, OngoingRun]:
        """The runs that are not over."""
        ...

    def next_number(self) -> int:
        """The number of a run that is taken in."""
        ...

    def watch(self, watcher: Callable[[OngoingRun], None]) -> None:
        """Be told, at once, of every run that has changed."""
        ...


async def settled(opened: OngoingRun) -> None:
    """Wait until what was shown of a run is stored; not for ever, when the journal is away."""
    with anyio.move_on_after(_SETTLED_S):
        await opened.recorder.flushed()
