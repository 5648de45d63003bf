"""Workers are there before they are needed, and never in the way of a start."""

from collections.abc import Iterator
from operator import add
from typing import Any

import anyio
import pytest
from anyio import CapacityLimiter

from action_assistant.web.workers import lanes
from action_assistant.web.workers.lanes import Crashed, Lane, kept_warm


class Watched(Lane):
    """Tells how often a worker is made ready without being asked for, and how often it was."""

    begun = warmed = 0

    async def warm(self) -> None:
        self.begun += 1
        await super().warm()
        self.warmed += 1


@pytest.fixture
def lane() -> Iterator[Watched]:
    made = Watched("try", 1, 30, 0, CapacityLimiter(4), ())
    yield made
    made.close()


async def test_a_start_makes_none(lane: Watched) -> None:
    async with kept_warm(lane):
        await anyio.sleep(0.2)
    assert lane.begun == 0


async def test_a_worker_is_warmed_without_any_request(
    lane: Watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "_FIRST_S", 0.01)
    async with kept_warm(lane):
        with anyio.fail_after(60):
            while not lane.warmed:  # noqa: ASYNC110 - nobody tells
                await anyio.sleep(0.01)


async def test_a_request_before_the_warm_up_gets_a_worker(lane: Watched) -> None:
    async with kept_warm(lane):
        assert await lane(add, 2, 3) == 5
    assert lane.begun == 0


async def test_a_worker_that_dies_before_its_first_work_counts_as_a_death(
    lane: Watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its number is written to it when it is made: there the one who makes it finds it gone."""

    def dying(*_: Any, **__: Any) -> Any:
        raise BrokenPipeError(32, "Broken pipe")

    with monkeypatch.context() as killed:
        killed.setattr(lanes, "child", dying)
        with pytest.raises(Crashed, match="has died; nothing came of it"):
            await lane(add, 2, 3)
    assert lane.deaths == 1
    assert await lane(add, 2, 3) == 5
