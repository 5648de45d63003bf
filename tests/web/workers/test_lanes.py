"""Workers are there before they are needed, and never in the way of a start."""

from collections.abc import Iterator
from operator import add

import anyio
import pytest
from anyio import CapacityLimiter

from action_assistant.web.workers import lanes
from action_assistant.web.workers.lanes import Lane, kept_warm


class Counted(Lane):
    """Tells how often a worker was made ready."""

    warmed = 0

    async def warm(self) -> None:
        await super().warm()
        self.warmed += 1


@pytest.fixture
def lane() -> Iterator[Counted]:
    made = Counted("try", 1, 30, 0, CapacityLimiter(4), ())
    yield made
    made.close()


async def test_a_start_makes_none(lane: Counted) -> None:
    async with kept_warm(lane):
        await anyio.sleep(0.2)
    assert lane.warmed == 0


async def test_one_is_there_after_it_though_nobody_has_asked(
    lane: Counted, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "_FIRST_S", 0.01)
    async with kept_warm(lane):
        with anyio.fail_after(60):
            while not lane.warmed:  # noqa: ASYNC110 - nobody tells
                await anyio.sleep(0.01)


async def test_who_asks_earlier_has_one_made(lane: Counted) -> None:
    async with kept_warm(lane):
        assert await lane(add, 2, 3) == 5
    assert lane.warmed == 0
