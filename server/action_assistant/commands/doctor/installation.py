"""Which installation is looked at."""

from pathlib import Path

import msgspec

from action_assistant import settings
from action_assistant.errors import CannotStart


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

    @staticmethod
    def port_of_settings() -> int:
        """The editor's as the environment has it; the usual one where that is no port."""
        try:
            return settings.port()
        except CannotStart:  # told as a finding
            return 8000

    @property
    def processes(self) -> tuple[tuple[str, int], ...]:
        """The editor and the runner, and their ports."""
        return ("editor", self.port), ("runner", self.port + 1)
