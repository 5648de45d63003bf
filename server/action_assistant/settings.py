"""Settings of a process at its start: command line first, then the environment."""

import os
import re
import socket
import sys
from collections.abc import Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.private_files import own_folder
from action_assistant.public_url import LOOPBACK_PROXIES, Network, PublicUrl, proxies, public_url

#: Every variable that this program reads, and what it is for.
VARIABLES: Final[Mapping[str, str]] = {
    "ACTION_ASSISTANT_DATA": "the data folder, where --data names none",
    "ACTION_ASSISTANT_PORT": "the editor's port, where --port names none (8000); the runner has the next",
    "ACTION_ASSISTANT_TOKEN": "the token programs present; instead of the file in the data folder",
    "ACTION_ASSISTANT_TOKEN_FILE": "a file with that token",
    "ACTION_ASSISTANT_DATABASE": "the editor's database; where --database would show its password to "
    "everybody on this computer",
    "ACTION_ASSISTANT_DATABASE_FILE": "a file with that URL",
    "ACTION_ASSISTANT_DATABASE_PASSWORD_FILE": "a file with the password of the database, where its URL "
    "has none; for Postgres, as PGPASSWORD",
    "ACTION_ASSISTANT_URL": "where the command line finds the editor (http://127.0.0.1:8000)",
    "ACTION_ASSISTANT_HOSTS": "more host names that may stand in the address bar, comma separated",
    "ACTION_ASSISTANT_SHARE": "`http` as --share, `tls` as --share --tls",
    "ACTION_ASSISTANT_PUBLIC_URL": "where a proxy shows the page to others, as --public-url",
    "ACTION_ASSISTANT_TRUSTED_PROXIES": "addresses and networks of proxies that are believed about who "
    "asks, as --trusted-proxies",
    "ACTION_ASSISTANT_RUNNERS": "several runners for one page, as --runner, such as "
    "`Hall A=http://127.0.0.1:8001;Hall B=http://127.0.0.1:8011` (the one beside the editor)",
    "ACTION_ASSISTANT_CLUSTER_LISTEN": "where an editor listens for the other editors of its database, as "
    "--cluster-listen",
    "ACTION_ASSISTANT_CLUSTER_URL": "where they find it, as --cluster-url",
    "ACTION_ASSISTANT_RUNNER_PYTHON": "the Python that has rclpy; `serve` runs the runner under it",
    "ACTION_ASSISTANT_KEEP_RUNS": "days after which runs go into archives (for ever)",
    "ACTION_ASSISTANT_KEEP_RAW": "days after which raw messages of robots go into archives; without "
    "it they are deleted after 7 days or beyond 500 MB",
    "ACTION_ASSISTANT_ARCHIVE": "the folder of archives (`archive` in the data folder)",
    "ACTION_ASSISTANT_INDEX_FOLDERS": "folders that robots index and the runner may write graphs into, as "
    f"--index-folder, separated by `{os.pathsep}`",
    "ACTION_ASSISTANT_LOG_FORMAT": "`json` for programs, `console` for people, as --log-format",
    "ACTION_ASSISTANT_LOG_LEVEL": "`debug`, `info`, `warning` or `error`, as --log-level",
    "ACTION_ASSISTANT_METRICS_TOKEN": "a token that opens /metrics and nothing else",
    "ACTION_ASSISTANT_METRICS_TOKEN_FILE": "a file with that token",
    "ACTION_ASSISTANT_AUDIT_DAYS": "days for which sign-ins, refusals and other rows that only the audit "
    "has are kept, by whole months (for ever)",
    "ACTION_ASSISTANT_TOKEN_DAYS": "the longest life of a token of a program, in days (365)",
    "ACTION_ASSISTANT_BACKUP_TO": "the folder of regular backups, as --backup-to of serve and --into of "
    "backup",
    "ACTION_ASSISTANT_BACKUP_EVERY": "how often `serve` makes one (24h), as --backup-every",
    "ACTION_ASSISTANT_BACKUP_KEEP": "how many stay (7d,4w,6m), as --backup-keep",
    "ACTION_ASSISTANT_BACKUP_AFTER": "the command that takes a finished one elsewhere, as --backup-after",
    "ACTION_ASSISTANT_SESSIONS": "when sessions expire, unused and in any case, by role, such as "
    "`owner=12h/7d,operator=3d/30d` (owner=7d/30d, operator=14d/30d, others 30d/30d)",
    "ACTION_ASSISTANT_FRAME_ORIGINS": "sites that may show links to one graph or run in a frame, such as "
    "`https://wiki.lab.example`, comma separated (none)",
    "ACTION_ASSISTANT_RUN_LINKS": "where other programs keep what they recorded of a run, such as "
    "`Video=https://nvr.lab.example/{robot}?from={from}&to={to}`, separated by `;` (none)",
    "ACTION_ASSISTANT_OIDC_ISSUER": "the OpenID Connect provider by which people may sign in, such as "
    "https://login.example.org/realms/lab",
    "ACTION_ASSISTANT_OIDC_CLIENT_ID": "the name of this program at that provider",
    "ACTION_ASSISTANT_OIDC_CLIENT_SECRET": "its secret there, unless it is a public client",
    "ACTION_ASSISTANT_OIDC_CLIENT_SECRET_FILE": "a file with that secret",
    "ACTION_ASSISTANT_OIDC_GROUPS": "the roles of the provider's groups, such as "
    "`robot-admins=owner,lab=operator,*=viewer`; `*` is everybody. Nobody else comes in",
    "ACTION_ASSISTANT_OIDC_GROUPS_CLAIM": "the claim with the groups of a person (groups)",
    "ACTION_ASSISTANT_OIDC_NAME": "the provider's name on the button (the host of the issuer)",
    "ACTION_ASSISTANT_NOTIFICATIONS": "a TOML file that names receivers of messages by webhook and mail",
    "ACTION_ASSISTANT_WATCHDOG": "seconds without an answer after which `serve` starts the editor anew "
    "(60); `off` for never",
    "ACTION_ASSISTANT_LIMITS": "other limits than sockets=100,address-sockets=200,mib-a-minute=16 (of a "
    "person), actions=5000,graph-mib=32 (of a graph, which may only be less); `off` lifts those of "
    "persons, for load tests",
    "ACTION_ASSISTANT_SOCKETS": "`asgi` has the messages of rooms go the long way through ASGI, should the "
    "direct one fail",
}
INDEX_FOLDERS: Final = "ACTION_ASSISTANT_INDEX_FOLDERS"
RUNNERS: Final = "ACTION_ASSISTANT_RUNNERS"
CLUSTER_LISTEN: Final = "ACTION_ASSISTANT_CLUSTER_LISTEN"
CLUSTER_URL: Final = "ACTION_ASSISTANT_CLUSTER_URL"
#: The URL of another editor: nothing is encrypted between editors, and no path goes before.
_PLAIN_URL: Final = re.compile(r"http://([A-Za-z0-9._-]+|\[[0-9a-fA-F:]+\]):\d{1,5}")
#: The variables that name a file with a secret, and the variable that the secret stands for.
_FILES: Final[Mapping[str, str]] = {
    "ACTION_ASSISTANT_TOKEN_FILE": "ACTION_ASSISTANT_TOKEN",
    "ACTION_ASSISTANT_DATABASE_FILE": "ACTION_ASSISTANT_DATABASE",
    "ACTION_ASSISTANT_METRICS_TOKEN_FILE": "ACTION_ASSISTANT_METRICS_TOKEN",
    "ACTION_ASSISTANT_OIDC_CLIENT_SECRET_FILE": "ACTION_ASSISTANT_OIDC_CLIENT_SECRET",
    "ACTION_ASSISTANT_DATABASE_PASSWORD_FILE": "PGPASSWORD",
}
#: An origin as `frame-ancestors` takes it; the first part of its host may be an asterisk.
_ORIGIN: Final = re.compile(r"https?://((\*\.)?[A-Za-z0-9.-]+|\[[0-9a-fA-F:]+\])(:\d{1,5})?")
#: Places in the address of a link from a run; the page fills them in.
_PLACES: Final = frozenset({"robot", "run", "from", "to", "at", "from_ms", "to_ms", "at_ms"})
_PLACE: Final = re.compile(r"\{([^{}]*)\}")
#: The start of an address that a browser opens; what follows the host may hold places.
_WEB: Final = re.compile(r"https?://[A-Za-z0-9.\[\]:-]+([/?#]\S*)?")
_OIDC: Final = "ACTION_ASSISTANT_OIDC_"
_SECRET: Final = 65_536  # characters of such a file
#: The folder of archives, inside the data folder.
ARCHIVE: Final = "archive"
#: Stands in a data folder while `restore` puts things into it.
RESTORING: Final = "restore.unfinished"
#: The longest life of a token of a program, in days, where no setting says otherwise.
TOKEN_DAYS: Final = 365.0
#: Seconds of silence after which `serve` starts the editor anew, where no setting says otherwise.
WATCHDOG_S: Final = 60.0
#: The host that stands for every address of this computer, of both families.
EVERYWHERE: Final = "*"
LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})
_MIN_TOKEN: Final = 32  # characters, as of the token that programs present


class Reachability(msgspec.Struct, frozen=True):
    """The ways by which others reach this server.

    `public`: the address at which a proxy serves it, if any. `proxies`: addresses whose forwarding
    headers are trusted.
    """

    public: PublicUrl | None = None
    proxies: tuple[Network, ...] = ()


class LoadLimits(msgspec.Struct, frozen=True, kw_only=True, rename="kebab"):
    """The load that one person may be, and how large a graph may become. `sockets`: that a person has
    open at a time; `address_sockets`: the same of an address; `mib_a_minute`: that a person sends;
    `actions`, `graph_mib`: of a graph."""

    sockets: int = 100
    address_sockets: int = 200
    mib_a_minute: int = 16
    actions: int = 5_000
    graph_mib: int = 32


#: The least and the most of each limit. Graphs beyond these do not open in time.
_LOAD_RANGES: Final[Mapping[str, tuple[int, int]]] = {
    "sockets": (10, 10_000),
    "address-sockets": (10, 100_000),
    "mib-a-minute": (1, 1_024),
    "actions": (10, 5_000),
    "graph-mib": (1, 32),
}


class RunLink(msgspec.Struct, frozen=True):
    """A link from each run on a robot to what another program recorded of it. `url`: with places such
    as `{robot}` and `{from}`, which the page fills in."""

    name: str
    url: str


class Site(msgspec.Struct, frozen=True):
    """A runner of a page that leads several. `name`: for people; `url`: without a slash at its
    end."""

    name: str
    url: str


class Cluster(msgspec.Struct, frozen=True):
    """The place of this editor among several of one database. `host`, `port`: where it listens for the others;
    `url`: where they find it, without a slash at its end."""

    host: str
    port: int
    url: str


class EditorSettings(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of the editor process. `database` is a URL such as `sqlite:////data/editor.db`.
    `sessions`: when sessions expire, as in ACTION_ASSISTANT_SESSIONS; `frames`: the origins of sites
    that may show links to one thing in a frame; `run_links`: as in ACTION_ASSISTANT_RUN_LINKS; `oidc`: the values of the variables
    ACTION_ASSISTANT_OIDC_…; `sites`: the runners of the page, if there are several; `cluster`: None for the only editor of its
    database."""

    data: Path
    database: str
    host: str = "127.0.0.1"
    port: int = 8000
    runner_port: int = 8001
    sites: tuple[Site, ...] = ()
    cluster: Cluster | None = None
    hosts: tuple[str, ...] = ()
    limits: bool = True
    load: LoadLimits = LoadLimits()
    share: bool = False
    tls: bool = False
    switch_database: bool = False
    reached: Reachability = Reachability()
    metrics_token: str | None = None
    sessions: str = ""
    token_days: float = TOKEN_DAYS
    frames: tuple[str, ...] = ()
    run_links: tuple[RunLink, ...] = ()
    oidc: Mapping[str, str] = {}
    notifications: Path | None = None
    audit_days: float | None = None


class Keep(msgspec.Struct, frozen=True, kw_only=True):
    """The number of days for which runs and raw messages stay before they are archived below
    `folder`; None for ever."""

    folder: Path
    runs: float | None = None
    raw: float | None = None


class RunnerSettings(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of the runner process.

    `page_port` is the port of the page that may talk to the runner. `behaviours` is the folder of
    Python files with which simulated actions may run. `index_folders` holds the folder that each
    robot indexes, by the robot's name.
    """

    data: Path
    host: str = "127.0.0.1"
    port: int = 8001
    page_port: int = 8000
    hosts: tuple[str, ...] = ()
    limits: bool = True
    load: LoadLimits = LoadLimits()
    share: bool = False
    tls: bool = False
    keep: Keep | None = None
    reached: Reachability = Reachability()
    behaviours: Path | None = None
    index_folders: Mapping[str, Path] = {}
    metrics_token: str | None = None
    sessions: str = ""
    notifications: Path | None = None
    audit_days: float | None = None


def check_environment(environ: Mapping[str, str] = os.environ) -> None:
    """Raise CannotStart if `environ` has an unknown variable that begins with ACTION_ASSISTANT_: a
    misspelt setting must not be ignored."""
    unknown = sorted(
        name for name in environ if name.startswith("ACTION_ASSISTANT_") and name not in VARIABLES
    )
    if unknown:
        known = ", ".join(VARIABLES)
        raise CannotStart(f"Unknown setting {', '.join(unknown)}. Known are: {known}.")


def take_secrets_from_files(environ: MutableMapping[str, str] = os.environ) -> None:
    """Read secrets from the files that variables of `environ` name, and set them in `environ`,
    which is also passed to processes that this one starts. Raise CannotStart if a file cannot be
    read or a secret is set twice."""
    for name, secret in _FILES.items():
        path = environ.get(name, "")
        if not path:
            environ.pop(name, None)
            continue
        if environ.get(secret):
            raise CannotStart(f"{name} and {secret} are both set; keep one of them.")
        try:
            with Path(path).open(encoding="utf-8") as file:
                text = file.read(_SECRET).strip()
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is no text"
            raise CannotStart(f"{name} is {path!r}, which cannot be read: {why}.") from error
        if not text or len(text.splitlines()) > 1:
            raise CannotStart(f"{name} is {path!r}, which has to hold one line.")
        environ[secret] = text
        del environ[name]  # a process that this one starts would find both


def port(environ: Mapping[str, str] = os.environ) -> int:
    """Return the port of the editor from ACTION_ASSISTANT_PORT, or 8000 if the variable is not set.
    Raise CannotStart unless it is a number from 1 to 65534."""
    text = environ.get("ACTION_ASSISTANT_PORT", "").strip() or "8000"
    if not text.isdecimal() or not 0 < int(text) < 65535:
        raise CannotStart(f"ACTION_ASSISTANT_PORT is a port below 65535, not {text!r}.")
    return int(text)


def port_number(text: str) -> int:
    """Parse the number of a port. Raise ValueError for another text."""
    number = int(text)
    if not 0 < number < 65536:
        raise ValueError
    return number


def cluster(listen: str, url: str, environ: Mapping[str, str] = os.environ) -> Cluster | None:
    """Return the place of an editor among several: `listen` (HOST:PORT) and `url` as the options give them,
    else as the environment does; None if it is the only one. Without a URL the others find it by the host
    that it listens at, or by this computer's name if that is every address. Raise CannotStart for another
    form."""
    listen = listen or environ.get(CLUSTER_LISTEN, "").strip()
    url = url or environ.get(CLUSTER_URL, "").strip()
    if not listen:
        return None
    host, sign, number = listen.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not sign or not host or not number.isdecimal() or not 0 < int(number) < 65536:
        raise CannotStart(f"--cluster-listen is HOST:PORT, not {listen!r}.")
    if not url:
        name = socket.gethostname() if host in {"0.0.0.0", "::"} else host
        url = f"http://{f'[{name}]' if ':' in name else name}:{number}"
    if not _PLAIN_URL.fullmatch(url):
        raise CannotStart(f"--cluster-url is http://HOST:PORT, not {url!r}.")
    return Cluster(host, int(number), url)


def share(environ: Mapping[str, str] = os.environ) -> str:
    """Return how ACTION_ASSISTANT_SHARE lets others on the network in: "" (not at all), "http" or
    "tls". Raise CannotStart for other values."""
    text = environ.get("ACTION_ASSISTANT_SHARE", "").strip().lower()
    if text not in {"", "http", "tls"}:
        raise CannotStart(f"ACTION_ASSISTANT_SHARE is `http` or `tls`, not {text!r}.")
    return text


def database(environ: Mapping[str, str] = os.environ) -> str | None:
    """Return the URL of the editor's database from ACTION_ASSISTANT_DATABASE; None if the variable
    is not set."""
    return environ.get("ACTION_ASSISTANT_DATABASE") or None


def hide_password() -> None:
    """Restart this program with the URL of --database in the environment, if it holds a password,
    since every user may read the arguments of a process."""
    for at, word in enumerate(sys.orig_argv):
        name, sign, url = word.partition("=")
        taken = 1 if sign else 2
        if not sign:
            url = next(iter(sys.orig_argv[at + 1 : at + 2]), "")
        if _is_database(name) and _has_password(url):
            rest = [*sys.orig_argv[1:at], *sys.orig_argv[at + taken :]]
            os.environ["ACTION_ASSISTANT_DATABASE"] = url
            os.environ.pop("ACTION_ASSISTANT_DATABASE_FILE", None)
            sys.stderr.flush()
            os.execv(sys.executable, [sys.orig_argv[0], *rest])


def hide_target_password() -> None:
    """Restart the program so that the URL of `--to`, which `move` and `runs copy` take, holds no
    password, since all users may read a command line. The database driver takes the password from
    the environment instead."""
    for at, word in enumerate(sys.orig_argv):
        name, sign, url = word.partition("=")
        if not sign:
            url = next(iter(sys.orig_argv[at + 1 : at + 2]), "")
        if name == "--to" and "://" in url and _has_password(url):
            from sqlalchemy import make_url

            parsed = make_url(url)
            if parsed.password is None:
                return
            os.environ["PGPASSWORD"] = str(parsed.password)
            plain = parsed._replace(password=None).render_as_string()
            rest = [*sys.orig_argv[1:at], "--to", plain, *sys.orig_argv[at + (1 if sign else 2) :]]
            sys.stderr.flush()
            os.execv(sys.executable, [sys.orig_argv[0], *rest])


def _is_database(name: str) -> bool:
    """Return whether the argument `name` is the option `--database` or a beginning of it that
    argparse accepts. `--data` is another option."""
    return len(name) > len("--data") and "--database".startswith(name)


def _has_password(url: str) -> bool:
    """Return whether a URL may hold a password. The test is wide on purpose: SQLAlchemy allows
    characters in a password that others read as its end."""
    return "@" in url or "password=" in url


def metrics_token(environ: Mapping[str, str] = os.environ) -> str | None:
    """Return the token of ACTION_ASSISTANT_METRICS_TOKEN, which opens only /metrics, or None if the
    variable is not set or empty. Raise CannotStart if the token is too short."""
    name = "ACTION_ASSISTANT_METRICS_TOKEN"
    token = environ.get(name, "").strip()
    if token and len(token) < _MIN_TOKEN:
        raise CannotStart(
            f"{name} has {len(token)} characters; a token must have at least {_MIN_TOKEN}."
        )
    return token or None


def backup_rule(name: str, environ: Mapping[str, str] = os.environ) -> str | None:
    """Return a setting of regular backups from the variable ACTION_ASSISTANT_BACKUP_<name>; None if
    it is not set. `name`: TO, EVERY, KEEP or AFTER."""
    return environ.get(f"ACTION_ASSISTANT_BACKUP_{name}", "").strip() or None


def sessions(environ: Mapping[str, str] = os.environ) -> str:
    """Return when sessions expire, by role, as the environment says it; "" for the defaults."""
    return environ.get("ACTION_ASSISTANT_SESSIONS", "").strip()


def frame_origins(environ: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """Return the origins of sites that may show links to one thing in a frame, as the environment
    says them. Raise CannotStart if one is no origin, such as one with a path or for every site."""
    written = environ.get("ACTION_ASSISTANT_FRAME_ORIGINS", "").replace(",", " ").split()
    for each in written:
        if _ORIGIN.fullmatch(each) is None:
            raise CannotStart(
                "ACTION_ASSISTANT_FRAME_ORIGINS is a list of origins, such as "
                f"`https://wiki.lab.example`, not {each!r}."
            )
    return tuple(written)


def run_links(environ: Mapping[str, str] = os.environ) -> tuple[RunLink, ...]:
    """Return the links from runs to what other programs recorded of them, as the environment says them.
    Raise CannotStart if one has no name, no web address, or a place that is not known."""
    variable = "ACTION_ASSISTANT_RUN_LINKS"
    found = []
    for each in filter(str.strip, environ.get(variable, "").split(";")):
        name, _, url = (part.strip() for part in each.partition("="))
        if not name or len(name) > 40 or _WEB.fullmatch(url) is None:
            raise CannotStart(
                f"{variable} is a list of NAME=URL with `;` between them, where a URL begins with "
                f"http:// or https:// and a host, not {each.strip()!r}."
            )
        for place in _PLACE.findall(url):
            if place not in _PLACES:
                places = ", ".join(f"{{{known}}}" for known in sorted(_PLACES))
                raise CannotStart(f"{variable}: {{{place}}} is none of {places}.")
        found.append(RunLink(name, url))
    return tuple(found)


def notifications(environ: Mapping[str, str] = os.environ) -> Path | None:
    """Return the file that names the receivers of messages; None if the variable is not set."""
    path = environ.get("ACTION_ASSISTANT_NOTIFICATIONS", "").strip()
    return Path(path) if path else None


def limits(environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether rates and numbers of sockets are limited: they are unless
    ACTION_ASSISTANT_LIMITS is `off`."""
    return environ.get("ACTION_ASSISTANT_LIMITS", "").strip().lower() != "off"


def load_limits(environ: Mapping[str, str] = os.environ) -> LoadLimits:
    """Return the limits of persons and graphs, as the environment says them; those that it does not
    name, or all if they are `off`, are the usual ones. Raise CannotStart for another name or number.
    """
    text = environ.get("ACTION_ASSISTANT_LIMITS", "").strip()
    if text.lower() in {"", "on", "off"}:
        return LoadLimits()
    found: dict[str, int] = {}
    for part in text.split(","):
        name, _, number = (each.strip() for each in part.partition("="))
        least, most = _LOAD_RANGES.get(name, (1, 0))
        if not number.isascii() or not number.isdigit() or not least <= int(number[:9]) <= most:
            ranges = ", ".join(f"{key}={low}…{high}" for key, (low, high) in _LOAD_RANGES.items())
            raise CannotStart(
                f"ACTION_ASSISTANT_LIMITS is `off`, or a list of {ranges}, not {part.strip()!r}."
            )
        found[name] = int(number)
    return msgspec.convert(found, LoadLimits)


def watchdog(environ: Mapping[str, str] = os.environ) -> float | None:
    """Return the seconds without an answer after which `serve` starts the editor anew; None if it
    never does. Raise CannotStart for a text that is neither `off` nor a number from 1 to 86,400."""
    text = environ.get("ACTION_ASSISTANT_WATCHDOG", "").strip().lower()
    if text == "off":
        return None
    try:
        seconds = float(text or WATCHDOG_S)
    except ValueError:
        seconds = 0.0
    if not 1 <= seconds <= 86_400:
        raise CannotStart(
            f"ACTION_ASSISTANT_WATCHDOG is a number of seconds from 1 to 86400, or `off`, not {text!r}."
        )
    return seconds


def direct_sockets(environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether rooms read their sockets directly and not through ASGI: they do unless
    ACTION_ASSISTANT_SOCKETS is `asgi`. Raise CannotStart for an unknown value."""
    way = environ.get("ACTION_ASSISTANT_SOCKETS", "").strip().lower()
    if way not in {"", "direct", "asgi"}:
        raise CannotStart(f"ACTION_ASSISTANT_SOCKETS is direct or asgi, not {way!r}.")
    return way != "asgi"


def keep(data: Path, environ: Mapping[str, str] = os.environ) -> Keep:
    """Return how many days runs and raw messages stay in the database before they are archived, and
    the folder of archives, by default in the data folder `data`. Raise CannotStart if a variable is
    malformed."""
    return Keep(
        folder=Path(environ.get("ACTION_ASSISTANT_ARCHIVE") or data / ARCHIVE).resolve(),
        runs=_days("ACTION_ASSISTANT_KEEP_RUNS", environ),
        raw=_days("ACTION_ASSISTANT_KEEP_RAW", environ),
    )


def token_days(environ: Mapping[str, str] = os.environ) -> float:
    """Return the longest life of a token of a program, in days. Raise CannotStart if the variable is
    malformed."""
    days = _days("ACTION_ASSISTANT_TOKEN_DAYS", environ)
    return TOKEN_DAYS if days is None else days


def audit_days(environ: Mapping[str, str] = os.environ) -> float | None:
    """Return for how many days rows that only the audit has are kept; None for ever. Raise CannotStart
    if the variable is malformed."""
    return _days("ACTION_ASSISTANT_AUDIT_DAYS", environ)


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


def oidc(environ: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the settings of the OpenID Connect provider that are not empty, by the part of their names
    after ACTION_ASSISTANT_OIDC_; `web/auth/provider_settings.py` reads them."""
    names = [name for name in VARIABLES if name.startswith(_OIDC) and name not in _FILES]
    given = {name.removeprefix(_OIDC): environ.get(name, "").strip() for name in names}
    return {name: text for name, text in given.items() if text}


def index_folders(
    given: Sequence[str] = (), environ: Mapping[str, str] = os.environ
) -> dict[str, Path]:
    """Return the index folder of each robot, by the name of the robot. `given`: texts ROBOT=DIR of
    the command line; if there are none, they are read from the environment. Raise CannotStart if a
    text is malformed or names a robot twice."""
    written = given or environ.get(INDEX_FOLDERS, "").split(os.pathsep)
    found: dict[str, Path] = {}
    for each in filter(str.strip, written):
        robot, sign, folder = (part.strip() for part in each.partition("="))
        if not (robot and sign and folder) or os.pathsep in folder:
            raise CannotStart(f"A folder that a robot indexes is written ROBOT=DIR, not {each!r}.")
        if robot in found:
            raise CannotStart(f"Two folders are named for {robot}: an engine indexes one.")
        found[robot] = Path(folder).expanduser().absolute()
    return found


def as_index_folders(folders: Mapping[str, Path]) -> str:
    """Return the folders in the form of the environment variable ACTION_ASSISTANT_INDEX_FOLDERS."""
    return os.pathsep.join(f"{robot}={folder}" for robot, folder in folders.items())


def more_hosts(environ: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """Return the host names in ACTION_ASSISTANT_HOSTS, in lower case, under which people reach the
    page beside the loopback names; empty if it is not set."""
    names = environ.get("ACTION_ASSISTANT_HOSTS", "")
    return tuple(name.strip().lower() for name in names.split(",") if name.strip())


def reached(
    url: str | None, trusted: str | None, environ: Mapping[str, str] = os.environ
) -> Reachability:
    """Return the public address (`url`) and the trusted proxies (`trusted`), each as the command
    line gives it or, if None, from the environment. Behind a public address, the proxies of this
    computer are trusted unless others are named. Raise CannotStart if an address is malformed."""
    written = url if url is not None else environ.get("ACTION_ASSISTANT_PUBLIC_URL", "")
    public = public_url(written) if written.strip() else None
    named = trusted if trusted is not None else environ.get("ACTION_ASSISTANT_TRUSTED_PROXIES", "")
    if named.strip() or public is None:
        return Reachability(public, proxies(named))
    return Reachability(public, LOOPBACK_PROXIES)


def check_host(
    host: str, hosts: tuple[str, ...], *, share: bool = False, public: PublicUrl | None = None
) -> None:
    """Raise CannotStart if strangers can reach the address `host` although neither sharing
    (`share`), host names nor a public address are set."""
    if host not in LOOPBACK and not hosts and not share and public is None:
        raise CannotStart(
            f"Listening on {host} would show this computer's graphs and robots to the network. "
            "Use --share to do that on purpose, or name the addresses that people may use in "
            "ACTION_ASSISTANT_HOSTS, or --public-url where a proxy stands before it."
        )


def data_folder(path: Path) -> Path:
    """Create the data folder `path` if it is missing, close it to other users, and return it. Raise
    CannotStart if it cannot be written or holds half of a backup."""
    settled(path)
    return own_folder(path)


def settled(path: Path) -> None:
    """Raise CannotStart if the data folder `path` holds half of a backup, since a restore was
    interrupted."""
    if (path / RESTORING).exists():
        raise CannotStart(
            f"A restore into {path} was interrupted, so that it holds parts of a backup: run "
            "`action-assistant restore` again."
        )
