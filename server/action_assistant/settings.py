"""What a process is told when it starts: command line first, then the environment."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.private_files import own_folder
from action_assistant.public_url import LOOPBACK_PROXIES, Network, PublicUrl, proxies, public_url

#: Every variable that this program reads, and what it is for.
VARIABLES: Final[Mapping[str, str]] = {
    "ACTION_ASSISTANT_TOKEN": "the token programs present; instead of the file in the data folder",
    "ACTION_ASSISTANT_DATABASE": "the editor's database; where --database would show its password to "
    "everybody on this computer",
    "ACTION_ASSISTANT_URL": "where the command line finds the editor (http://127.0.0.1:8000)",
    "ACTION_ASSISTANT_HOSTS": "more host names that may stand in the address bar, comma separated",
    "ACTION_ASSISTANT_PUBLIC_URL": "where a proxy shows the page to others, as --public-url",
    "ACTION_ASSISTANT_TRUSTED_PROXIES": "addresses and networks of proxies that are believed about who "
    "asks, as --trusted-proxies",
    "ACTION_ASSISTANT_RUNNER_PYTHON": "the Python that has rclpy; `serve` runs the runner under it",
    "ACTION_ASSISTANT_KEEP_RUNS": "days after which runs go into archives (for ever)",
    "ACTION_ASSISTANT_KEEP_RAW": "days after which raw messages of robots go into archives; without "
    "it they are deleted after 7 days or beyond 500 MB",
    "ACTION_ASSISTANT_ARCHIVE": "the folder of archives (`archive` in the data folder)",
    "ACTION_ASSISTANT_LIMITS": "`off` lifts rate and socket limits, for load tests",
    "ACTION_ASSISTANT_SOCKETS": "`asgi` has the messages of rooms go the long way through ASGI, should the "
    "direct one fail",
}
#: The folder of archives, inside the data folder.
ARCHIVE: Final = "archive"
#: Stands in a data folder while `restore` puts things into it.
RESTORING: Final = "restore.unfinished"
#: The host that stands for every address of this computer, of both families.
EVERYWHERE: Final = "*"
LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})


class Reachability(msgspec.Struct, frozen=True):
    """How others come to us: by a public address that a proxy shows, if there is one. `proxies` are
    believed about the address of whoever asks."""

    public: PublicUrl | None = None
    proxies: tuple[Network, ...] = ()


class EditorSettings(msgspec.Struct, frozen=True, kw_only=True):
    """How the editor runs. `database` is a URL such as `sqlite:////data/editor.db`."""

    data: Path
    database: str
    host: str = "127.0.0.1"
    port: int = 8000
    runner_port: int = 8001
    hosts: tuple[str, ...] = ()
    limits: bool = True
    share: bool = False
    tls: bool = False
    switch_database: bool = False
    reached: Reachability = Reachability()


class Keep(msgspec.Struct, frozen=True, kw_only=True):
    """For how many days runs and raw messages stay here before they go into archives below `folder`;
    None for ever."""

    folder: Path
    runs: float | None = None
    raw: float | None = None


class RunnerSettings(msgspec.Struct, frozen=True, kw_only=True):
    """How the runner runs. `page_port` is the port of the page that may talk to it, `behaviours` the
    folder of Python files that simulated actions may be run with."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8001
    page_port: int = 8000
    hosts: tuple[str, ...] = ()
    limits: bool = True
    share: bool = False
    tls: bool = False
    keep: Keep | None = None
    reached: Reachability = Reachability()
    behaviours: Path | None = None


def check_environment(environ: Mapping[str, str] = os.environ) -> None:
    """Refuse names that nobody reads: a misspelt setting must not be ignored in silence."""
    unknown = sorted(
        name for name in environ if name.startswith("ACTION_ASSISTANT_") and name not in VARIABLES
    )
    if unknown:
        known = ", ".join(VARIABLES)
        raise CannotStart(f"Unknown setting {', '.join(unknown)}. Known are: {known}.")


def database(environ: Mapping[str, str] = os.environ) -> str | None:
    """The editor's, when the command line names none."""
    return environ.get("ACTION_ASSISTANT_DATABASE") or None


def hide_password() -> None:
    """Start this program anew with what --database says in the environment, if a password is in it:
    every user of a computer may read the arguments of every process."""
    for at, word in enumerate(sys.orig_argv):
        name, sign, url = word.partition("=")
        taken = 1 if sign else 2
        if not sign:
            url = next(iter(sys.orig_argv[at + 1 : at + 2]), "")
        if _is_database(name) and _has_password(url):
            rest = [*sys.orig_argv[1:at], *sys.orig_argv[at + taken :]]
            os.environ["ACTION_ASSISTANT_DATABASE"] = url
            sys.stderr.flush()
            os.execv(sys.executable, [sys.orig_argv[0], *rest])


def _is_database(name: str) -> bool:
    """Also as far as argparse takes it for that; `--data` is an option of its own."""
    return len(name) > len("--data") and "--database".startswith(name)


def _has_password(url: str) -> bool:
    """Or may have: SQLAlchemy allows characters in it that others take for its end."""
    return "@" in url or "password=" in url


def limits(environ: Mapping[str, str] = os.environ) -> bool:
    """Whether rate and socket limits hold."""
    return environ.get("ACTION_ASSISTANT_LIMITS", "").lower() != "off"


def direct_sockets(environ: Mapping[str, str] = os.environ) -> bool:
    """Whether rooms take their sockets over from the server below. Raises CannotStart."""
    way = environ.get("ACTION_ASSISTANT_SOCKETS", "").strip().lower()
    if way not in {"", "direct", "asgi"}:
        raise CannotStart(f"ACTION_ASSISTANT_SOCKETS is direct or asgi, not {way!r}.")
    return way != "asgi"


def keep(data: Path, environ: Mapping[str, str] = os.environ) -> Keep:
    """What is kept here, and for how long. Raises CannotStart."""
    return Keep(
        folder=Path(environ.get("ACTION_ASSISTANT_ARCHIVE") or data / ARCHIVE).resolve(),
        runs=_days("ACTION_ASSISTANT_KEEP_RUNS", environ),
        raw=_days("ACTION_ASSISTANT_KEEP_RAW", environ),
    )


def _days(name: str, environ: Mapping[str, str]) -> float | None:
    text = environ.get(name, "").strip()
    if not text:
        return None
    try:
        days = float(text)
    except ValueError:
        days = -1.0
    if not 0 <= days < 1e6:
        raise CannotStart(f"{name} is a number of days, not {text!r}.")
    return days


def more_hosts(environ: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """Host names, beside the loopback ones, under which people reach the page."""
    names = environ.get("ACTION_ASSISTANT_HOSTS", "")
    return tuple(name.strip().lower() for name in names.split(",") if name.strip())


def reached(
    url: str | None, trusted: str | None, environ: Mapping[str, str] = os.environ
) -> Reachability:
    """What the command line says, else the environment. Behind a public address the proxies of this
    computer are believed unless others are named. Raises CannotStart."""
    written = url if url is not None else environ.get("ACTION_ASSISTANT_PUBLIC_URL", "")
    public = public_url(written) if written.strip() else None
    named = trusted if trusted is not None else environ.get("ACTION_ASSISTANT_TRUSTED_PROXIES", "")
    if named.strip() or public is None:
        return Reachability(public, proxies(named))
    return Reachability(public, LOOPBACK_PROXIES)


def check_host(
    host: str, hosts: tuple[str, ...], *, share: bool = False, public: PublicUrl | None = None
) -> None:
    """Refuse to listen where strangers are unless somebody said so, or by which names."""
    if host not in LOOPBACK and not hosts and not share and public is None:
        raise CannotStart(
            f"Listening on {host} would show this computer's graphs and robots to the network. "
            "Use --share to do that on purpose, or name the addresses that people may use in "
            "ACTION_ASSISTANT_HOSTS, or --public-url where a proxy stands before it."
        )


def data_folder(path: Path) -> Path:
    """A data folder, made if need be, proven writable and closed to other users. Raises CannotStart."""
    settled(path)
    return own_folder(path)


def settled(path: Path) -> None:
    """Raise CannotStart for a folder that holds half of a backup."""
    if (path / RESTORING).exists():
        raise CannotStart(
            f"A restore into {path} was interrupted, so that it holds parts of a backup: run "
            "`action-assistant restore` again."
        )
