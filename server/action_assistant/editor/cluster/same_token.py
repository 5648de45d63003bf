"""Compares the tokens of all editors of a database: what one seals, the others have to open."""

import hmac
from typing import Any, Final

from sqlalchemy import Connection, text

from action_assistant.errors import CannotStart
from action_assistant.journal.journal import Journal

_NOW: Final = "(extract(epoch FROM clock_timestamp()) * 1000000)::bigint"
_ALIVE_US: Final = 5_000_000  # since the last beat of an editor that counts
_SHOW: Final = text("UPDATE editor SET proof = :proof WHERE slot = :slot")
_OTHERS: Final = text(
    f"SELECT url FROM editor WHERE proof <> :proof AND beat_at > {_NOW} - {_ALIVE_US} ORDER BY slot"
)


async def require_same_token(journal: Journal, key: bytes) -> None:
    """Show to the other editors of this database which token this one has, without showing the token, and
    compare. `key`: the one that follows from the token, for what editors relay. Raise CannotStart if a living
    editor has another token, Unavailable if the database does not answer. Of two that start at once with
    different tokens at least one is refused, since each shows first and compares then."""
    proof = hmac.digest(key, b"an editor of this database", "sha256")
    values: dict[str, Any] = {"proof": proof, "slot": journal.slot}

    def show(connection: Connection) -> None:
        connection.execute(_SHOW, values)

    def compare(connection: Connection) -> list[str]:
        return [row.url for row in connection.execute(_OTHERS, values)]

    await journal.derive(show)
    others = await journal.derive(compare)
    if others:
        raise CannotStart(
            f"The editor at {others[0]} has another token. All editors of one database need the same token "
            "and the same data folder: start them with the same --data, or give them the same "
            "ACTION_ASSISTANT_TOKEN."
        )
