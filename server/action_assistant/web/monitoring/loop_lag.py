"""Measures how late the event loop is, which delays everybody, also a Stop."""

import asyncio
from collections import deque
from collections.abc import Iterator
from typing import Final

from prometheus_client import Histogram, Metric
from prometheus_client.registry import Collector

_TICK_S: Final = 0.25
_REMEMBERED: Final = 240  # ticks: a minute
_BUCKETS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10)


class LoopLag(Collector):
    """Sleeps for a while again and again, and notes how much later it woke up."""

    def __init__(self) -> None:
        self._last: deque[float] = deque(maxlen=_REMEMBERED)
        self._lag = Histogram(
            "action_assistant_loop_lag_seconds",
            "How much later than asked for the event loop did something, looked at each 0.25 s.",
            registry=None,
            buckets=_BUCKETS,
        )

    async def run(self) -> None:
        """Measure the lag of the event loop until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + _TICK_S
            await asyncio.sleep(_TICK_S)
            late = max(0.0, loop.time() - due)
            self._lag.observe(late)
            self._last.append(late)

    @property
    def worst_s(self) -> float:
        """Return the worst lag of the event loop in the last minute, in seconds."""
        return max(self._last, default=0.0)

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics that a Prometheus registry asks for."""
        yield from self._lag.collect()
