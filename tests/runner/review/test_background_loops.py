"""Keyframes of long runs are kept while they go on."""

from typing import Any

import anyio

from action_assistant.errors import Unavailable
from action_assistant.runner.analysis.keyframes import APART
from action_assistant.runner.review.background_loops import KeyframeLoop, due_after
from runner.harness import virtual


class Recorder:
    def __init__(self) -> None:
        self.seq = 0


class Going:
    """A run as far as the loop looks at it."""

    def __init__(self, name: str) -> None:
        self.run: Any = self
        self.id, self.end = name, None
        self.recorder = Recorder()


class Ongoing:
    """Runs that tell of their changes."""

    def __init__(self) -> None:
        self.watchers: list[Any] = []
        self.watch = self.watchers.append

    def reached(self, run: Going, seq: int) -> None:
        run.recorder.seq = seq
        for watcher in self.watchers:
            watcher(run)


@virtual
async def test_keyframes_are_made_at_multiples_and_not_after_the_end() -> None:
    ongoing: Any = Ongoing()
    asked: list[str] = []

    async def make(run: str) -> None:
        asked.append(run)
        await anyio.sleep(1)
        if len(asked) == 1:
            raise Unavailable("the workers are busy")

    async with anyio.create_task_group() as tasks:
        keyframes = KeyframeLoop(make)
        ongoing.watch(lambda opened: keyframes.run_changed(opened.run, opened.recorder))
        tasks.start_soon(keyframes.run)
        long, short = Going("long"), Going("short")
        for seq in (1, APART - 1, APART, APART + 1, 2 * APART - 1):
            ongoing.reached(long, seq)
            ongoing.reached(short, seq // APART)
            await anyio.sleep(3)
        assert asked == ["long"]
        ongoing.reached(long, 2 * APART)  # the first time came to nothing
        await anyio.sleep(3)
        assert asked == ["long"] * 2
        ongoing.reached(long, 3 * APART)
        long.end = "finished"
        ongoing.reached(long, 3 * APART + 1)
        await anyio.sleep(3)
        assert asked == ["long"] * 2
        tasks.cancel_scope.cancel()


def test_an_eighth_is_left_to_fold_and_the_writes_stay_bounded() -> None:
    kept, written = 0, 0
    while kept < 1_000:
        due = due_after(kept)
        assert due - kept <= max(1, due / 8)
        kept, written = due, written + due
    assert written < 10 * kept
