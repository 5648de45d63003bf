"""The installation that is examined."""

from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import msgspec

from action_assistant import settings
from action_assistant.errors import CannotStart
from action_assistant.system.served_addresses import served_address


class Installation(msgspec.Struct, frozen=True, kw_only=True):
    """A data folder, and the ports of its processes: the editor at `port`, the runner at
    `runner_port`, or, if that is None, at the port after the editor's.

    `database`: the editor's, if not the one that the folder remembers. `public_url`: where a proxy
    serves the page; None takes ACTION_ASSISTANT_PUBLIC_URL.
    """

    data: Path
    database: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    runner_port: int | None = None
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
        return ("editor", self.port), ("runner", self.runner_port or self.port + 1)

    def where_served(self) -> "Installation":
        """Return this installation with the addresses that its processes have kept in the data
        folder. A process that does not serve it here and now keeps the address that it has."""
        found = self
        with suppress(CannotStart):  # an address that cannot be read: the usual ports are asked
            for address, name in (
                (served_address(self.data, "editor"), "port"),
                (served_address(self.data, "runner"), "runner_port"),
            ):
                if address is not None and address.lives and address.is_here:
                    url = urlsplit(address.url)
                    found = msgspec.structs.replace(
                        found, host=url.hostname or self.host, **{name: url.port}
                    )
        return found
