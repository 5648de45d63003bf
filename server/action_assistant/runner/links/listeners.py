"""Listeners of a link, told in the order in which they were added."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

_News = TypeVar("_News")


class Listeners(Generic[_News]):
    """The listeners of a link or of a domain. They are called synchronously and must not wait."""

    def __init__(self) -> None:
        self._all: list[Callable[[_News], None]] = []

    def tell(self, news: _News) -> None:
        """Call every listener with `news`, also one that another listener removes meanwhile. An
        exception of a listener reaches the caller, and those after it are not called."""
        for hear in tuple(self._all):
            hear(news)

    @contextmanager
    def listening(self, hear: Callable[[_News], None]) -> Iterator[None]:
        """Return a context manager; inside of its block `hear` is called with each piece of
        news."""
        self._all.append(hear)
        try:
            yield
        finally:
            self._all.remove(hear)
