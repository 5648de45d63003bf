"""The installation that is examined."""

from pathlib import Path

import msgspec

from action_assistant import settings
from action_assistant.errors import CannotStart


class Installation(msgspec.Struct, frozen=True, kw_only=True):
    """A data folder, and the ports of its processes: the editor at `port`, the runner at the next
    one.

    `database`: the editor's, if not the one that the folder remembers. `public_url`: where a proxy
    serves the page; None takes ACTION_ASSISTANT_PUBLIC_URL.
    """

    data: Path
    database: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    public_url: str | None = None

    @staticmethod
    def port_of_settings() -> int:
        """Return the editor's port by the environment; the default if that is no port."""
        try:
            return settings.port()
        except CannotStart:  # reported as a finding
            return 8000

    @property
    def processes(self) -> tuple[tuple[str, int], ...]:
        """Return the names and ports of the editor and the runner."""
        return ("editor", self.port), ("runner", self.port + 1)
