"""The port between the runner and an engine: commands without answers, one question, reports.

A command's return says that the message has left, never that it was obeyed. Only `get` is answered.
Whoever implements this keeps messages on one topic apart as the engine needs (the runner may call
`stop` for several graphs at once) and never repeats a start.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Literal, Protocol, TypeAlias

import msgspec

from action_assistant.runner.seen import Exact, Snapshot
from action_assistant.umrf.model import Graph

EngineState: TypeAlias = Literal["answering", "busy", "gone", "restarted"]


class NotSent(Exception):
    """The message has certainly not left; the text says why."""


class EngineRefused(Exception):
    """The engine has said that it does not do this; the text is its own."""


class NoAnswer(Exception):
    """The engine did not answer a get in time, or cannot; the text says what is known."""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """One start: the graph as a value, and the text that carries the run's identity."""

    run: str
    graph: Graph
    umrf: str
    targets: tuple[str, ...] = ()


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """What an engine answered to one get: every graph it holds, ended ones too.

    `asked_at` and `at` are microseconds UTC; `incarnation` changes when the engine is restarted.
    """

    asked_at: int
    at: int
    incarnation: str
    graphs: tuple[Snapshot, ...]


class Transitions(msgspec.Struct, frozen=True, kw_only=True):
    """Exact changes, oldest first. Only the simulator can tell them."""

    run: str
    changes: tuple[Exact, ...]


class Feedback(msgspec.Struct, frozen=True, kw_only=True):
    """Snapshots that came by themselves, oldest first. Some are always missing."""

    actor: str
    snapshots: tuple[Snapshot, ...]


class EngineLog(msgspec.Struct, frozen=True, kw_only=True):
    """A line of the engine's log. Evidence for a person, proof of nothing."""

    at: int
    text: str
    graph: str | None = None


class EngineChanged(msgspec.Struct, frozen=True, kw_only=True):
    """The engine came, went, or is another one than before; `why` is for people."""

    at: int
    state: EngineState
    incarnation: str = ""
    why: str = ""


class ForeignCommand(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody else published a command to this engine."""

    at: int
    command: Literal["start", "stop", "pause", "resume", "modify"]
    graph: str
    umrf: str = ""


Report: TypeAlias = Transitions | Feedback | EngineLog | EngineChanged | ForeignCommand


class Link(Protocol):
    """An engine within reach."""

    @property
    def simulated(self) -> bool:
        """Whether nothing moves in the world when this engine is told to."""
        ...

    @property
    def pauses(self) -> bool:
        """Whether pausing is safe on this engine."""
        ...

    async def start(self, order: Order) -> None:
        """Publish one start message. Raises NotSent, EngineRefused."""
        ...

    async def stop(self, graph_name: str) -> None:
        """Publish one stop message. Raises NotSent."""
        ...

    async def pause(self, graph_name: str) -> None:
        """Publish one pause message. Raises NotSent."""
        ...

    async def resume(self, graph_name: str, continue_from: str = "") -> None:
        """Publish one resume message. Raises NotSent."""
        ...

    async def get(self) -> Answer:
        """Ask what the engine holds. Raises NoAnswer; the caller sets the deadline."""
        ...

    async def run(self) -> None:
        """Serve until cancelled. The runner keeps this going for as long as it needs the link."""
        ...

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Be told everything the engine shows by itself, on the event loop, in order, at once: a
        report that came before an answer is heard before `get` returns."""
        ...

    async def aclose(self) -> None:
        """Let go of the engine. A real one goes on; a simulated one ends."""
        ...
