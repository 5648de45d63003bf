"""The receivers of notifications, as the administrator names them in a TOML file."""

import base64
import hashlib
import ipaddress
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias
from urllib.parse import SplitResult, urlsplit

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.public_url import Network
from action_assistant.web.notifications.messages import KINDS

_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_ADDRESS: Final = re.compile(r"[^\s@<>,;:\"\\]+@[^\s@<>,;:\"\\]+")
_PREFIX: Final = "whsec_"
_SHORTEST_KEY, _LONGEST_KEY = 24, 64  # bytes, by Standard Webhooks
_SECRET_FILE: Final = 4096  # characters
_MOST: Final = 20  # receivers
_PORTS: Final[Mapping["Security", int]] = {"none": 25, "starttls": 587, "tls": 465}

Security: TypeAlias = Literal["starttls", "tls", "none"]


class Webhook(msgspec.Struct, frozen=True, kw_only=True):
    """A receiver by HTTP. `key`: signs messages. `allow`: private networks in which its host may
    be; `ca`: a file with the authorities to trust instead of the system's."""

    name: str
    kinds: frozenset[str]
    url: SplitResult
    key: bytes
    allow: tuple[Network, ...] = ()
    ca: str | None = None

    @property
    def shown(self) -> str:
        """Return the host. The rest of the URL may be a secret."""
        return self.url.hostname or ""


class Mailbox(msgspec.Struct, frozen=True, kw_only=True):
    """A receiver by mail. `host` and `port`: of the mail server, which may be in the private networks
    `allow`; `ca`: a file with the authorities to trust instead of the system's."""

    name: str
    kinds: frozenset[str]
    host: str
    port: int
    security: Security
    sender: str
    to: tuple[str, ...]
    user: str = ""
    password: str = ""
    allow: tuple[Network, ...] = ()
    ca: str | None = None

    @property
    def shown(self) -> str:
        """Return the addresses that get the mails."""
        return ", ".join(self.to)


Receiver: TypeAlias = Webhook | Mailbox


def target_of(receiver: Receiver) -> str:
    """Return a digest of the address of a receiver. It changes with the address, and shows nothing
    of it."""
    if isinstance(receiver, Webhook):
        text = receiver.url.geturl()
    else:
        text = f"{receiver.host}:{receiver.port} {receiver.shown}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def receivers_of(path: Path | None, kinds: Iterable[str] = KINDS) -> tuple[Receiver, ...]:
    """Return the receivers that a settings file names and that want some of these kinds. Raise
    CannotStart, with the place, if the file cannot be read or is malformed."""
    if path is None:
        return ()
    try:
        with path.open("rb") as file:
            found = tomllib.load(file)
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise CannotStart(f"The notifications file {path} cannot be read: {why}.") from error
    unknown = sorted(set(found) - {"webhooks", "mail"})
    if unknown:
        raise CannotStart(f"{path}: unknown table {unknown[0]!r}; known are webhooks and mail.")
    made: list[Receiver] = []
    for table, make in (("webhooks", _webhook), ("mail", _mailbox)):
        for name, fields in _table(found, table, path).items():
            place = _Place(path, f"{table}.{name}")
            if _NAME.fullmatch(name) is None:
                raise place.error("a name has letters a-z, digits and hyphens, at most 40")
            if not isinstance(fields, dict):
                raise place.error("this is a table")
            made.append(make(name, _Fields(fields, place)))
    names = [each.name for each in made]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise CannotStart(f"{path}: two receivers are called {twice[0]!r}.")
    if len(made) > _MOST:
        raise CannotStart(f"{path}: at most {_MOST} receivers.")
    return tuple(each for each in made if not each.kinds.isdisjoint(kinds))


class _Place(msgspec.Struct, frozen=True):
    path: Path
    table: str

    def error(self, why: str, field: str = "") -> CannotStart:
        at = f"{self.table}.{field}" if field else self.table
        return CannotStart(f"{self.path}: {at}: {why}.")


class _Fields:
    """Reads the fields of one receiver; each may be read once, and none may be left."""

    def __init__(self, fields: dict[str, Any], place: _Place) -> None:
        self._fields = dict(fields)
        self.place = place

    def text(self, name: str, default: str | None = None) -> str:
        value = self._fields.pop(name, default)
        if not isinstance(value, str) or (default is None and not value):
            raise self.place.error("a text is needed", name)
        return value

    def texts(self, name: str) -> tuple[str, ...]:
        value = self._fields.pop(name, [])
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise self.place.error("a list of texts is needed", name)
        return tuple(value)

    def number(self, name: str, default: int) -> int:
        value = self._fields.pop(name, default)
        if not isinstance(value, int) or not 0 < value < 65536:
            raise self.place.error("a port is needed", name)
        return value

    def secret(self, name: str) -> str:
        """Return the secret in the file that the field `NAME_file` names."""
        field = f"{name}_file"
        file = self.text(field)
        try:
            with Path(file).open(encoding="utf-8") as opened:
                text = opened.read(_SECRET_FILE).strip()
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is no text"
            raise self.place.error(f"{file!r} cannot be read: {why}", field) from error
        if not text or len(text.splitlines()) > 1:
            raise self.place.error(f"{file!r} has to hold one line", field)
        return text

    def has(self, name: str) -> bool:
        return name in self._fields

    def kinds(self) -> frozenset[str]:
        chosen = self.texts("kinds") if self.has("kinds") else tuple(KINDS)
        unknown = [each for each in chosen if each not in KINDS]
        if unknown or not chosen:
            named = f"{unknown[0]!r} is no kind" if unknown else "none is named"
            raise self.place.error(f"{named}; kinds are {', '.join(KINDS)}", "kinds")
        return frozenset(chosen)

    def networks(self) -> tuple[Network, ...]:
        try:
            return tuple(ipaddress.ip_network(each) for each in self.texts("allow"))
        except ValueError as error:
            raise self.place.error(f"{error}", "allow") from error

    def end(self) -> None:
        if self._fields:
            raise self.place.error("this field is unknown", min(self._fields))


def _table(found: Mapping[str, Any], name: str, path: Path) -> Mapping[str, Any]:
    table = found.get(name, {})
    if not isinstance(table, dict):
        raise CannotStart(f"{path}: {name} is a table of receivers.")
    return table


def _webhook(name: str, fields: _Fields) -> Webhook:
    url = urlsplit(fields.secret("url") if fields.has("url_file") else fields.text("url"))
    allow = fields.networks()
    try:
        usable = url.scheme in {"http", "https"} and bool(url.hostname) and (url.port or 1) > 0
    except ValueError:
        usable = False
    if not usable or url.username is not None or any(c.isspace() for c in url.geturl()):
        raise fields.place.error("an address such as https://example.org/hook is needed", "url")
    if not url.geturl().isascii():
        raise fields.place.error("an address has ASCII characters only", "url")
    if url.scheme == "http" and not allow:
        raise fields.place.error("http is for hosts in `allow` only; use https", "url")
    made = Webhook(
        name=name,
        kinds=fields.kinds(),
        url=url,
        key=_key(fields),
        allow=allow,
        ca=fields.text("ca", "") or None,
    )
    fields.end()
    return made


def _key(fields: _Fields) -> bytes:
    text = fields.secret("secret")
    try:
        key = base64.b64decode(text.removeprefix(_PREFIX), validate=True)
    except ValueError:
        key = b""
    if not text.startswith(_PREFIX) or not _SHORTEST_KEY <= len(key) <= _LONGEST_KEY:
        why = f"it has to be {_PREFIX} and {_SHORTEST_KEY} to {_LONGEST_KEY} random bytes in base64"
        raise fields.place.error(why, "secret_file")
    return key


def _mailbox(name: str, fields: _Fields) -> Mailbox:
    wanted = fields.text("security", "starttls")
    security = next((each for each in _PORTS if each == wanted), None)
    if security is None:
        raise fields.place.error(f"it is {', '.join(_PORTS)}", "security")
    allow = fields.networks()
    if security == "none" and not allow:
        raise fields.place.error("`none` is for hosts in `allow` only", "security")
    sender, to = fields.text("from"), fields.texts("to")
    for field, address in (("from", sender), *(("to", each) for each in to)):
        if _ADDRESS.fullmatch(address) is None or not address.isascii():
            raise fields.place.error(f"{address!r} is no mail address", field)
    if not to:
        raise fields.place.error("a mail address is needed", "to")
    host = fields.text("host")
    if not host.isascii() or any(c.isspace() or c in "/@" for c in host):
        raise fields.place.error("the name of a mail server is needed", "host")
    user = fields.text("user", "")
    if user and security == "none":
        raise fields.place.error("a password is not sent without encryption", "user")
    made = Mailbox(
        name=name,
        kinds=fields.kinds(),
        host=host,
        port=fields.number("port", _PORTS[security]),
        security=security,
        sender=sender,
        to=to,
        user=user,
        password=fields.secret("password") if user else "",
        allow=allow,
        ca=fields.text("ca", "") or None,
    )
    fields.end()
    return made
