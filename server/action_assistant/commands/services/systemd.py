"""Asks systemd, and tells it what to do: of this computer, of a user, or of an image below a folder."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from action_assistant.commands.services.unit import NAME, Scope
from action_assistant.errors import CannotStart

_BOOTED: Final = Path("/run/systemd/system")


class Systemd:
    """The manager of a scope. With `root` nothing is started: systemd of that image will."""

    def __init__(self, scope: Scope, root: Path | None = None) -> None:
        self.scope: Final = scope
        self.root: Final = root

    @property
    def unit(self) -> Path:
        """Where the unit is."""
        if self.root is not None:
            return self.root / "etc" / "systemd" / self.scope / NAME
        if self.scope == "system":
            return Path("/etc/systemd/system", NAME)
        return _config() / "systemd" / "user" / NAME

    @property
    def settings(self) -> Path:
        """The file in which settings of the service stand, secrets among them."""
        if self.scope == "system":
            return Path("/etc/action-assistant/environment")
        return _config() / "temoto-action-assistant" / "environment"

    def require(self) -> None:
        """Raises CannotStart where there is no systemd that could run the service."""
        if shutil.which("systemctl") is None or (self.root is None and not _BOOTED.is_dir()):
            raise CannotStart(
                "systemd does not run this computer, so it cannot run a service here. Start `action-"
                "assistant serve` by what does (a container, launchd, runit); `service install --print` "
                "shows the unit for elsewhere."
            )

    def command(self, *words: str) -> list[str]:
        """A command to the manager."""
        if self.root is not None:
            scope = ["--global"] if self.scope == "user" else []
            return ["systemctl", f"--root={self.root}", *scope, *words]
        return ["systemctl", *(["--user"] if self.scope == "user" else []), *words]

    def do(self, commands: Sequence[Sequence[str]]) -> None:
        """Run commands one after the other. Raises CannotStart with what the first that fails says."""
        for each in commands:
            answer = subprocess.run(each, capture_output=True, text=True, check=False)
            if answer.returncode:
                why = (answer.stderr or answer.stdout).strip().splitlines()
                raise CannotStart(
                    f"`{' '.join(each)}` failed: {why[-1] if why else answer.returncode}"
                )

    def state(self) -> dict[str, str]:
        """What the manager says of the service; nothing where it cannot be asked."""
        wanted = "LoadState,ActiveState,SubState,MainPID,NRestarts,UnitFileState,DropInPaths"
        answer = subprocess.run(
            self.command("show", NAME, "--property", wanted),
            capture_output=True,
            text=True,
            check=False,
        )
        lines = (line.partition("=") for line in answer.stdout.splitlines())
        return {name: value for name, _, value in lines}


def _config() -> Path:
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
