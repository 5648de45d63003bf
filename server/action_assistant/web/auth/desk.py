"""States that live in memory for minutes while somebody signs in, such as codes. One process has them, and of
several editors one of them."""

from collections.abc import Callable
from functools import partial
from typing import Concatenate, Final, Generic, ParamSpec, TypeVar

from anyio import to_thread

_S = TypeVar("_S")
_P = ParamSpec("_P")
_R = TypeVar("_R")


class Held(Generic[_S]):
    """Calls methods of a state (`store`). `slow`: in threads."""

    def __init__(self, store: _S, *, slow: bool = False) -> None:
        self.store: Final = store
        self._slow = slow

    async def call(
        self, method: Callable[Concatenate[_S, _P], _R], *args: _P.args, **kwargs: _P.kwargs
    ) -> _R:
        """Return what a method of the state returns, and raise what it raises. Where another editor has
        the state, raise Unavailable if it does not answer, OutcomeUnknown if its answer was lost."""
        return await self.here(method, *args, **kwargs)

    async def here(
        self, method: Callable[Concatenate[_S, _P], _R], *args: _P.args, **kwargs: _P.kwargs
    ) -> _R:
        """Do what `call` does with the state in the memory of this process."""
        if self._slow:
            return await to_thread.run_sync(partial(method, self.store, *args, **kwargs))
        return method(self.store, *args, **kwargs)


class Desk:
    """The states of a process that shares none."""

    def hold(self, store: _S, *, slow: bool = False) -> Held[_S]:
        """Return how to call a state. The parameters are those of `Held`."""
        return Held(store, slow=slow)
