"""Owners of graphs, where several editors share one database.

The owner of a stream has its room open and is the only one who appends to it. The log fences that by the epoch
of the stream: an answer of `owner` may be old when it arrives, and the append or the other editor finds that
out.
"""

from collections.abc import Callable
from typing import Final, Protocol, TypeAlias

import msgspec


class Here(msgspec.Struct, frozen=True, gc=False):
    """This editor owns the stream. `epoch`: how often the stream had changed hands then; appends to it
    name this number, and are refused once another editor has taken the stream. None where streams have no
    other owners."""

    epoch: int | None


class Elsewhere(msgspec.Struct, frozen=True, gc=False):
    """Another living editor owns the stream. `url`: where it takes what other editors relay, without a
    slash at its end; `slot`: its number."""

    url: str
    slot: int


class Nobody(msgspec.Struct, frozen=True, gc=False):
    """The stream has no owner, since it has no events: there is no such graph, and every editor may say so."""


Owner: TypeAlias = Here | Elsewhere | Nobody


class Owners(Protocol):
    """Says who owns a stream, for one editor. All methods are called on the event loop."""

    async def owner(self, stream: str) -> Owner:
        """Return the owner of a stream. If no living editor owns it, or its owner gives its rooms up, this
        editor takes it, if anything is stored in it. An answer Elsewhere is never cached: ask again if that
        editor does not answer.
        Raise Unavailable if the database does not answer, or if this editor would have to take the
        stream while it is draining."""

    async def give_up(self, stream: str) -> None:
        """Own a stream no longer, so that the next editor that needs it takes it. Call this after its room
        was closed; a stream that is owned elsewhere stays there. Never raise: if the database does not
        answer, the stream is taken from this editor when it has ended."""

    def check_again(self, stream: str) -> None:
        """Forget what is known of the owner of a stream, since its room has ended: the next `owner` asks the
        database."""

    @property
    def draining(self) -> bool:
        """Return whether this editor gives its rooms up and takes no others, because it ends."""

    async def drain(self) -> None:
        """Take no streams any more, and let other editors take those of this one, because it ends."""

    def when_lost(self, hear: Callable[[str], object]) -> None:
        """Call `hear` from now on with each stream that this editor has owned and that another one has
        taken, or that it may own no longer because the database does not hear it. Its room has to close
        its sockets with 1012 at once. `hear` must not raise."""


class Alone:
    """The owner of every stream: the only editor of its database."""

    draining: Final = False

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
