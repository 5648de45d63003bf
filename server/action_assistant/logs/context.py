"""What a line of a log is about: the request, run, graph or robot that a task works on.

Whoever begins a task says so once; every line that it writes then carries these ids.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

Subject: TypeAlias = Literal["request", "run", "graph", "robot"]

_NOTHING: Final[Mapping[str, str]] = MappingProxyType({})
_SUBJECTS: Final[ContextVar[Mapping[str, str]]] = ContextVar("subjects", default=_NOTHING)


def subjects() -> Mapping[str, str]:
    """Return the ids that log lines of this task carry, by kind of subject."""
    return _SUBJECTS.get()


def request_id() -> str | None:
    """Return the id of the request that this task answers; None without one."""
    return _SUBJECTS.get().get("request")


def begin(ids: Mapping[str, str]) -> None:
    """Let log lines of this task, and of tasks that it starts, carry exactly these ids."""
    _SUBJECTS.set(ids)


def is_about(subject: Subject, id_of_it: str) -> None:
    """Add an id to those that log lines of this task, and of tasks that it starts, carry."""
    _SUBJECTS.set({**_SUBJECTS.get(), subject: id_of_it})


@contextmanager
def about(subject: Subject, id_of_it: str) -> Iterator[None]:
    """Add a subject and its id to every log line that is written inside the block."""
    token = _SUBJECTS.set({**_SUBJECTS.get(), subject: id_of_it})
    try:
        yield
    finally:
        _SUBJECTS.reset(token)
