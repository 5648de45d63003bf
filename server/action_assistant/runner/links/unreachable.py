"""The link to a robot that cannot be reached: refuses every command."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Final

import anyio

from action_assistant.runner.links.port import (
    Answer,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    unwatched,
)


class UnreachableLink:
    """Stands in where a run is known but its robot is out of reach."""

    simulated: Final = False
    pauses: Final = False

    def __init__(self, why: str) -> None:
        self._why = why

    @property
    def standing(self) -> Standing:
        """Gone, for all anybody knows."""
        return Standing(state="gone", why=self._why)

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Refuses."""
        raise NotSent(self._why)

    async def stop(self, graph_name: str) -> None:
        """Refuses."""
        raise NotSent(self._why)

    async def pause(self, graph_name: str) -> None:
        """Refuses."""
        raise NotSent(self._why)

    async def resume(self, graph_name: str, continue_from: str = "") -> None:
        """Refuses."""
        raise NotSent(self._why)

    async def modify(self, order: Order, continue_from: str = "") -> None:
        """Refuses."""
        raise NotSent(self._why)

    async def get(self) -> Answer:
        """Refuses."""
        raise NoAnswer(self._why)

    async def run(self) -> None:
        """Nothing to keep going."""
        await anyio.sleep_forever()

    def listen(self, _: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Nothing is ever reported."""
        return nullcontext()

    async def aclose(self) -> None:
        """Nothing to let go of."""
