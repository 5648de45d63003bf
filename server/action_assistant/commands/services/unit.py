"""The text of a unit, and whether one that is there is still as it was written.

Its first lines say by which options it was made, and hold a digest of the rest: whoever edits the file
changes that, and is never overwritten without a word.
"""

import hashlib
import os
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.version import VERSION

Scope: TypeAlias = Literal["user", "system"]

NAME: Final = "action-assistant.service"
#: Variables of a sourced ROS 2 that the runner needs; packages are found by the first.
SOURCED: Final = (
    *("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH", "ROS_DISTRO", "ROS_VERSION", "ROS_DOMAIN_ID"),
    *("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"),
    *("RMW_IMPLEMENTATION", "CYCLONEDDS_URI", "FASTDDS_BUILTIN_TRANSPORTS"),
    *("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"),
)
_DIGEST: Final = "# sha256: "
_OPTIONS: Final = "# options: "
_PLAIN: Final = re.compile(r"[A-Za-z0-9_@%+=:,./-]+")
#: Restrictions by seccomp and prctl, which a user's own manager can apply, too.
_HARDENED: Final = (
    "NoNewPrivileges=yes",
    "LockPersonality=yes",
    "RestrictRealtime=yes",
    "RestrictSUIDSGID=yes",
    "RestrictNamespaces=yes",
    "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK",
    "SystemCallArchitectures=native",
    "SystemCallFilter=@system-service",
    "SystemCallErrorNumber=EPERM",
)
#: Restrictions by namespaces and capabilities. /dev/shm is not private, since engines share it.
_ENCLOSED: Final = (
    "ProtectSystem=strict",
    "ProtectHome=read-only",
    "PrivateTmp=yes",
    "PrivateDevices=yes",
    "ProtectKernelTunables=yes",
    "ProtectKernelModules=yes",
    "ProtectKernelLogs=yes",
    "ProtectControlGroups=yes",
    "ProtectHostname=yes",
    "ProtectClock=yes",
    "CapabilityBoundingSet=",
    "KeyringMode=private",
)


class ServicePlan(msgspec.Struct, frozen=True, kw_only=True):
    """The content of a service.

    `data` is None for the folder that systemd keeps for it. `words` are options of `serve`,
    `options` those of `service install` that make the same service again. `writes` lists folders
    beside the data folder to which the service writes.
    """

    scope: Scope
    program: tuple[str, ...]
    words: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    data: Path | None = None
    user: str = ""
    environment: Mapping[str, str] = {}
    settings: Path
    writes: tuple[Path, ...] = ()


def text_of(plan: ServicePlan) -> str:
    """Return the whole text of the unit file for a service."""
    body = "\n".join([*_unit(plan), *_service(plan), *_install(plan), ""])
    head = (
        f"# Made by `action-assistant service install`, version {VERSION}. What you want otherwise\n"
        f"# belongs into `systemctl {'--user ' * (plan.scope == 'user')}edit {NAME}`.\n"
    )
    rest = f"{head}{_OPTIONS}{msgspec.json.encode(plan.options).decode()}\n{body}"
    return f"{_DIGEST}{_digest(rest)}\n{rest}"


def is_untouched(text: str) -> bool:
    """Return whether the text of a unit is as this program, in any version, wrote it."""
    first, _, rest = text.partition("\n")
    return first == f"{_DIGEST}{_digest(rest)}"


def options_of(text: str) -> tuple[str, ...] | None:
    """Return the options by which a unit with this text was made; None if this program did not make
    it."""
    for line in text.splitlines()[:6]:
        if line.startswith(_OPTIONS):
            try:
                return msgspec.json.decode(line.removeprefix(_OPTIONS), type=tuple[str, ...])
            except msgspec.DecodeError:
                return None
    return None


def quoted(word: str) -> str:
    """Quote one word of a command or an assignment in a unit, so that systemd reads it back
    unchanged."""
    plain = word.replace("%", "%%")
    if _PLAIN.fullmatch(plain):
        return plain
    escaped = plain.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _unit(plan: ServicePlan) -> Sequence[str]:
    network = ("Wants=network-online.target", "After=network-online.target")
    return (
        "[Unit]",
        "Description=TeMoto Action Assistant: design, run and review robot tasks",
        *(network if plan.scope == "system" else ()),
        "# A database that comes up later than this must not end it for good.",
        "StartLimitIntervalSec=0",
        "",
    )


def _service(plan: ServicePlan) -> Sequence[str]:
    data = str(plan.data) if plan.data is not None else "%S/action-assistant"
    shown = quoted(data) if plan.data is not None else data
    words = [_in_command(each) for each in (*plan.program, "serve", "--no-open")]
    command = [*words, "--data", shown.replace("$", "$$"), *map(_in_command, plan.words)]
    lines = ["[Service]", "Type=exec", f"ExecStart={' '.join(command)}"]
    lines += [
        f"Environment={quoted(f'{name}={value}')}"
        for name, value in sorted(plan.environment.items())
    ]
    lines += [
        f"EnvironmentFile=-{str(plan.settings).replace('%', '%%')}",
        "Environment=PYTHONSAFEPATH=1",
        "# The supervisor is told, and ends both processes, the runner last.",
        "KillMode=mixed",
        "TimeoutStopSec=30",
        "Restart=on-failure",
        "RestartSec=5",
        "LimitNOFILE=65536",
        "UMask=0077",
        *_HARDENED,
    ]
    return [*lines, *(_of_the_computer(plan) if plan.scope == "system" else ()), ""]


def _of_the_computer(plan: ServicePlan) -> Sequence[str]:
    state = (
        ("StateDirectory=action-assistant", "StateDirectoryMode=0700") if plan.data is None else ()
    )
    writes = [*([plan.data] if plan.data is not None else []), *plan.writes]
    return (
        f"User={plan.user}",
        *state,
        *(f"ReadWritePaths={quoted(str(each))}" for each in writes),
        "# Stop has to work when memory runs short; workers go first.",
        "OOMScoreAdjust=-500",
        *_ENCLOSED,
    )


def _install(plan: ServicePlan) -> Sequence[str]:
    wanted = "multi-user.target" if plan.scope == "system" else "default.target"
    return "[Install]", f"WantedBy={wanted}"


def _in_command(word: str) -> str:
    return quoted(word).replace("$", "$$")


_BOOTED: Final = Path("/run/systemd/system")


class Systemd:
    """The systemd of a scope, system or user. With `root`, the folder of an image, nothing is
    started: systemd of that image will do so."""

    def __init__(self, scope: Scope, root: Path | None = None) -> None:
        self.scope: Final = scope
        self.root: Final = root

    @property
    def unit(self) -> Path:
        """Return the path of the service's unit file."""
        if self.root is not None:
            return self.root / "etc" / "systemd" / self.scope / NAME
        if self.scope == "system":
            return Path("/etc/systemd/system", NAME)
        return _config() / "systemd" / "user" / NAME

    @property
    def settings(self) -> Path:
        """Return the path of the file with the service's settings, secrets among them."""
        if self.scope == "system":
            return Path("/etc/action-assistant/environment")
        return _config() / "temoto-action-assistant" / "environment"

    def require(self) -> None:
        """Raise CannotStart if no systemd here could run the service."""
        if shutil.which("systemctl") is None or (self.root is None and not _BOOTED.is_dir()):
            raise CannotStart(
                "systemd does not run this computer, so it cannot run a service here. Start `action-"
                "assistant serve` by what does (a container, launchd, runit); `service install --print` "
                "shows the unit for elsewhere."
            )

    def command(self, *words: str) -> list[str]:
        """Return the systemctl command with these arguments for this scope."""
        if self.root is not None:
            scope = ["--global"] if self.scope == "user" else []
            return ["systemctl", f"--root={self.root}", *scope, *words]
        return ["systemctl", *(["--user"] if self.scope == "user" else []), *words]

    def do(self, commands: Sequence[Sequence[str]]) -> None:
        """Run commands one after the other. Raise CannotStart, with the output, at the first that
        fails."""
        for each in commands:
            answer = subprocess.run(each, capture_output=True, text=True, check=False)
            if answer.returncode:
                why = (answer.stderr or answer.stdout).strip().splitlines()
                raise CannotStart(
                    f"`{' '.join(each)}` failed: {why[-1] if why else answer.returncode}"
                )

    def state(self) -> dict[str, str]:
        """Return the service's properties, as systemd's manager reports them: name → value. Return
        an empty dict if the manager does not answer."""
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
