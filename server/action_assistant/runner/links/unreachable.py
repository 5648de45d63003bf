"""The link to a robot that cannot be reached: refuses every command."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Final, NoReturn

import anyio

from action_assistant.runner.links.port import (
    Answer,
    NoAnswer,
    NotSent,
    Report,
    Standing,
)


class UnreachableLink:
    """The link for a run whose robot cannot be reached: every command raises NotSent with the reason, `get`
    raises NoAnswer, and nothing is ever reported."""

    simulated: Final = False
    pauses: Final = False

    def __init__(self, why: str) -> None:
        self._why = why

    @property
    def standing(self) -> Standing:
        """The condition `gone`, with the reason."""
        return Standing(state="gone", why=self._why)

    async def _refuse(self, *_: object, **__: object) -> NoReturn:
        """Raise NotSent: there is no engine that could be reached."""
        raise NotSent(self._why)

    start = stop = pause = resume = modify = _refuse

    async def get(self) -> Answer:
        """Raise NoAnswer: there is no engine that could be asked."""
        raise NoAnswer(self._why)

    async def run(self) -> None:
        """Wait until cancelled; such a link has no work to do."""
        await anyio.sleep_forever()

    def listen(self, _: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context in which nothing is ever reported."""
        return nullcontext()

    async def aclose(self) -> None:
        """Do nothing: such a link has nothing to close."""
