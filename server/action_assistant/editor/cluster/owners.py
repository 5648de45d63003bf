"""Owners of graphs, where several editors share one database.

Only the owner of a stream opens its room and appends to it. An answer of `owner` may be old when it
arrives; then the log refuses the append, which names the epoch of the stream, or the other editor
refuses what was relayed.
"""

from collections.abc import Callable
from typing import Final, Protocol, TypeAlias

import msgspec


class Here(msgspec.Struct, frozen=True, gc=False):
    """This editor owns the stream. `epoch`: how often the stream was taken until then; appends to
    it name this number, and are refused once another editor has taken the stream. None if this is
    the only editor."""

    epoch: int | None


class Elsewhere(msgspec.Struct, frozen=True, gc=False):
    """Another living editor owns the stream. `url`: where it takes what other editors relay,
    without a slash at its end."""

    url: str


class Nobody(msgspec.Struct, frozen=True, gc=False):
    """The stream has no owner, since it has no events: there is no such graph, and every editor may
    say so."""


Owner: TypeAlias = Here | Elsewhere | Nobody


class Owners(Protocol):
    """Says who owns a stream, for one editor. All methods are called on the event loop."""

    async def owner(self, stream: str) -> Owner:
        """Return the owner of a stream. If no living editor owns it, or its owner gives its rooms
        up, this editor takes it, if anything is stored in it. An answer Elsewhere is never cached:
        ask again if that editor does not answer. Raise Unavailable if the database does not answer,
        or if this editor would have to take the stream while it is draining."""

    async def give_up(self, stream: str) -> None:
        """Own a stream no longer, so that the next editor that needs it takes it. Call this after
        its room was closed; a stream that is owned elsewhere stays there. Never raise: if the
        database does not answer, the stream is taken from this editor when it has ended."""

    def check_again(self, stream: str) -> None:
        """Forget what is known of the owner of a stream, since its room has ended: the next `owner`
        asks the database."""

    async def drain(self) -> None:
        """Take no streams any more, and let other editors take those of this one, because it
        ends."""

    def when_lost(self, hear: Callable[[str], object]) -> None:
        """Call `hear` from now on with each stream that this editor has lost: another one has taken
        it, or may do so, since the database does not hear this one. Its room has to close its
        sockets with 1012 at once. `hear` must not raise."""


class Alone:
    """The owner of every stream: the only editor of its database."""

    async def owner(self, stream: str) -> Owner:
        """Return at once that this editor owns the stream, which never changes hands."""
        del stream
        return _ALWAYS

    async def give_up(self, stream: str) -> None:
        """Do nothing: there is nobody else."""

    def check_again(self, stream: str) -> None:
        """Do nothing: the owner is always this editor."""

    async def drain(self) -> None:
        """Do nothing: there is nobody else."""

    def when_lost(self, hear: Callable[[str], object]) -> None:
        """Do nothing: no stream is ever lost."""


_ALWAYS: Final = Here(None)
