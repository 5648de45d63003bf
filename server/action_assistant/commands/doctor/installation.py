"""Which installation is looked at."""

from pathlib import Path

import msgspec


class Installation(msgspec.Struct, frozen=True, kw_only=True):
    """A data folder, and where its processes should be: the editor at `port`, the runner after it.

    `database`: the editor's, if it is not the one that the folder remembers. `public_url`: where a
    proxy shows the page; None takes ACTION_ASSISTANT_PUBLIC_URL.
    """

    data: Path
    database: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    public_url: str | None = None

    @property
    def processes(self) -> tuple[tuple[str, int], ...]:
        """The editor and the runner, and their ports."""
        return ("editor", self.port), ("runner", self.port + 1)
