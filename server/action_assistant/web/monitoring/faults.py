"""Notices what a person has to mend, without Prometheus: for the administration page and as messages.

Each process watches itself and the other one, which can still tell when a database is away.
"""

import logging
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from http.client import HTTPException
from pathlib import Path
from typing import Final, TypeAlias
from urllib.parse import urlsplit

import anyio
import msgspec
from anyio import to_thread
from sqlalchemy import Connection, insert, select

from action_assistant.errors import CannotStart, Refused
from action_assistant.journal.copies.backup_state import BackupState
from action_assistant.journal.journal import Journal
from action_assistant.private_files import replace_file
from action_assistant.safe_text import hold_names
from action_assistant.schema import editor_tables
from action_assistant.system.served_addresses import Process, served_address
from action_assistant.web.monitoring.storage import Storage
from action_assistant.web.notifications.outbox import row
from action_assistant.web.notifications.receivers import Receiver

log: Final = logging.getLogger(__name__)

#: The kind of the messages, which both processes send.
KIND: Final = "server.fault"
#: The file in the data folder in which `serve` notes a process that it has ended since it hung.
ENDED_FILE: Final = "hangs.json"
#: Sentences by the stable name of a fault.
Faults: TypeAlias = Mapping[str, str]
Look: TypeAlias = Callable[[], Awaitable[Faults]]

_LOOK_S: Final = 15.0
_LASTS_S: Final = 60.0  # a fault is told once it lasts so long: a restart is none
_AGAIN_US: Final = 24 * 3600 * 1_000_000  # between two messages about one fault
_SHOWN_S: Final = 24 * 3600.0  # for which a process that was ended is shown
_ANSWER_S: Final = 8.0  # `/readyz` answers within five seconds
_SCARCE, _SHARE = 1_000_000_000, 0.05  # bytes, and part of the disk, as docs/monitoring/alerts.yml
_ENDS_SOON: Final = timedelta(days=14)
_CERTIFICATE_EACH_S: Final = 3600.0
_PARTS: Final = ("database", "writer", "schema", "disk", "recording")


class Fault(msgspec.Struct, frozen=True):
    """A condition that a person has to mend. `what`: a stable name; `text`: a sentence; `since`: when
    this process saw it first."""

    what: str
    text: str
    since: datetime

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Hang(msgspec.Struct, frozen=True):
    """A process that `serve` has ended at `at` (seconds since 1970) after `silent_s` of silence."""

    at: float
    silent_s: float


class FaultWatch:
    """Looks for faults periodically, and writes a message to each receiver that wants them about
    one that lasts, once a day at most. `left`: which faults the other process tells at present."""

    def __init__(
        self,
        journal: Journal,
        receivers: Sequence[Receiver],
        looks: Sequence[Look],
        *,
        left: Callable[[Faults], Awaitable[frozenset[str]]] | None = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._journal = journal
        self._receivers = [each.name for each in receivers if KIND in each.kinds]
        self._looks = looks
        self._left = left
        self._clock = clock
        self._told: dict[str, float] = {}
        self.found: tuple[Fault, ...] = ()

    async def run(self) -> None:
        """Look for faults every 15 s until cancelled, and send messages about those that last."""
        while True:
            await self.look()
            await anyio.sleep(_LOOK_S)

    async def look(self) -> None:
        """Look once, and keep what is found in `found`."""
        now = self._clock()
        since = {each.what: each.since for each in self.found}
        texts: dict[str, str] = {}
        for look in self._looks:
            try:
                texts |= await look()
            except Exception:  # a fault in monitoring must not end a process
                log.exception("faults were not looked for")
        began = datetime.fromtimestamp(now, UTC)
        self.found = tuple(
            Fault(what, text, since.get(what, began)) for what, text in sorted(texts.items())
        )
        left = frozenset() if self._left is None else await self._left(texts)
        for fault in self.found:
            if fault.what not in left and now - fault.since.timestamp() >= _LASTS_S:
                await self._tell(fault, now)

    async def _tell(self, fault: Fault, now: float) -> None:
        at = round(now * 1_000_000)
        if not self._receivers or at - self._told.get(fault.what, -_AGAIN_US) < _AGAIN_US:
            return

        def write(connection: Connection) -> None:
            for receiver in self._receivers:
                if not _was_told(connection, receiver, fault.what, at - _AGAIN_US):
                    id_ = f"fault/{fault.what}:{at}:{receiver}"
                    facts = {"what": fault.what, "why": fault.text}
                    connection.execute(
                        insert(_outbox), row(id_, receiver, KIND, fault.what, at, facts)
                    )

        try:
            await self._journal.derive(write)
        except Refused as error:  # the other process tells that the database of this one is away
            log.debug("a message about %s is not stored: %s", fault.what, error.detail)
            return
        self._told[fault.what] = at


_outbox: Final = editor_tables.outbox


def _was_told(connection: Connection, receiver: str, what: str, after: int) -> bool:
    c = _outbox.c
    found = select(c.id).where(
        c.receiver == receiver, c.kind == KIND, c.subject == what, c.at > after
    )
    return connection.execute(found.limit(1)).first() is not None


def storage_faults(found: Storage | None, backups: BackupState | None, now: float) -> Faults:
    """Return what is wrong with disk and backups. `now`: seconds since 1970."""
    faults: dict[str, str] = {}
    if found is not None and (found.free < _SCARCE or found.free < _SHARE * found.size):
        left, size = found.free / 1e9, found.size / 1e9
        faults["disk"] = f"{left:.1f} of {size:.1f} GB are left of the disk of the data folder."
    if backups is None:
        return faults
    if backups.failed is not None:
        faults["backup"] = f"The newest backup failed: {backups.failed.why}"
    elif backups.is_late(now):
        faults["backup"] = (
            "A backup is overdue: the program that makes them does not run, or hangs."
        )
    elif backups.last is not None and backups.last.off_site and backups.last.off_site.why:
        faults["backup"] = f"The last backup was not taken elsewhere: {backups.last.off_site.why}"
    return faults


def own_faults(process: Process, parts: Mapping[str, str | None]) -> Faults:
    """Return what is wrong with a process, by the parts of its readiness."""
    wrong = [text for name in _PARTS if (text := parts.get(name))]
    return {process: f"The {process} cannot do its work. {' '.join(wrong)}"} if wrong else {}


def other_faults(data: Path, other: Process) -> Faults:
    """Return what is wrong with the other process of a data folder; nothing if it is not to be seen
    from here, or was ended in the usual way. Blocks for some seconds."""
    try:
        address = served_address(data, other)
    except CannotStart as error:
        return {other: str(error)}
    if address is None or not address.is_here:
        return {}
    away = (
        "Graphs cannot be opened."
        if other == "editor"
        else "NO STOP MAY ARRIVE: use the robots' hardware stop."
    )
    if not address.lives:
        return {other: f"The {other} has ended unexpectedly. {away}"}
    parts = _parts_at(address.url, data)
    if parts is None:
        return {other: f"The {other} runs, and does not answer. {away}"}
    return own_faults(other, parts)


def _parts_at(url: str, data: Path) -> Mapping[str, str | None] | None:
    """Return the parts of the readiness of a process; None if it does not answer."""
    handlers: list[urllib.request.BaseHandler] = [urllib.request.ProxyHandler({})]
    if url.startswith("https:"):
        # Most do without, and it takes as long to load as much of the rest.
        from action_assistant.web.network.certificate import Certificate

        handlers.append(urllib.request.HTTPSHandler(context=Certificate(data).trusting()))
    try:
        with urllib.request.build_opener(*handlers).open(f"{url}/readyz", timeout=_ANSWER_S) as ok:
            return _parts_in(ok.read())
    except urllib.error.HTTPError as refusal:
        with refusal:
            return _parts_in(refusal.read())
    except (OSError, HTTPException):
        return None


class _Parts(msgspec.Struct):
    parts: dict[str, str | None] = {}


def _parts_in(body: bytes) -> Mapping[str, str | None]:
    try:
        return msgspec.json.decode(body, type=_Parts).parts
    except msgspec.DecodeError:
        return {}


class CertificateLook:
    """Asks once an hour for the certificate at a public address, whoever has issued it, and reports
    one that ends within two weeks. Does nothing for an address without HTTPS."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self._at = (parts.hostname or "", parts.port or 443)
        self._is_https = parts.scheme == "https"
        self._asked = -_CERTIFICATE_EACH_S
        self._found: Faults = {}

    async def look(self) -> Faults:
        """Return the fault of a certificate that ends soon or has ended."""
        if self._is_https and time.monotonic() - self._asked >= _CERTIFICATE_EACH_S:
            self._asked = time.monotonic()
            self._found = await to_thread.run_sync(self._look, abandon_on_cancel=True)
        return self._found

    def _look(self) -> Faults:
        from cryptography import x509  # takes long to load

        try:
            pem = ssl.get_server_certificate(self._at, timeout=_ANSWER_S)
            ends = x509.load_pem_x509_certificate(pem.encode()).not_valid_after_utc
        except (OSError, ValueError):  # `doctor` names what is wrong with the address
            return {}
        return certificate_faults(self._at[0], ends, datetime.now(UTC))


class OwnCertificateLook:
    """Knows when the certificate ends with which this process listens: that of its start, since one
    that is issued later is not used before the next. `data`: the data folder that has it."""

    def __init__(self, data: Path) -> None:
        self._data = data
        self._ends: datetime | None = None

    async def look(self) -> Faults:
        """Return the fault of a certificate that ends soon or has ended."""
        if self._ends is None:
            self._ends = await to_thread.run_sync(_end_of, self._data)
        remedy = "start the program anew, which issues another"
        found = certificate_faults("this server", self._ends, datetime.now(UTC), remedy)
        return {f"own-{what}": text for what, text in found.items()}


def _end_of(data: Path) -> datetime:
    from cryptography import x509  # takes long to load

    from action_assistant.web.network.certificate import Certificate

    return x509.load_pem_x509_certificate(Certificate(data).chain.read_bytes()).not_valid_after_utc


def certificate_faults(
    host: str, ends: datetime, now: datetime, remedy: str = "renew it"
) -> Faults:
    """Return the fault of a certificate that ends within two weeks."""
    if ends - now > _ENDS_SOON:
        return {}
    how = "ended" if ends <= now else "ends"
    return {"certificate": f"The certificate of {host} {how} on {ends:%Y-%m-%d}: {remedy}."}


def note_hang(data: Path, process: str, hang: Hang) -> None:
    """Keep in the data folder that a process was ended since it hung. Raise OSError if that cannot
    be written."""
    path = data / ENDED_FILE
    content = msgspec.json.encode({**_hangs(data), process: hang})
    replace_file(path, content, part=path.with_name(f".{ENDED_FILE}.part"))


def hang_faults(data: Path, now: float) -> Faults:
    """Return the processes that were ended within a day since they hung. `now`: seconds since 1970."""
    return {
        f"{name}-hung": (
            f"The {name} did not answer for {hang.silent_s:.0f} s and was started anew at "
            f"{datetime.fromtimestamp(hang.at, UTC):%H:%M UTC}: its log says what it did before."
        )
        for name, hang in _hangs(data).items()
        if now - hang.at < _SHOWN_S
    }


def _hangs(data: Path) -> dict[str, Hang]:
    try:
        return msgspec.json.decode((data / ENDED_FILE).read_bytes(), type=dict[str, Hang])
    except (OSError, ValueError):
        return {}


def watch_of(
    process: Process,
    data: Path,
    journal: Journal,
    receivers: Sequence[Receiver],
    *,
    page: str,
    tls: bool,
    storage: Callable[[], tuple[Storage | None, BackupState | None]],
) -> FaultWatch:
    """Return the watch of a process. The editor also looks at backups, at what `serve` has ended,
    and at certificates: of the public address `page`, "" if there is none, and with `tls` its own.
    Of the disk that both share it sends the message, if it works."""
    other: Process = "runner" if process == "editor" else "editor"

    async def stored() -> Faults:
        return storage_faults(*storage(), time.time())

    async def parts() -> Faults:
        return own_faults(process, await journal.parts())

    async def beside() -> Faults:
        return await to_thread.run_sync(other_faults, data, other, abandon_on_cancel=True)

    async def hung() -> Faults:
        return await to_thread.run_sync(hang_faults, data, time.time())

    async def left(texts: Faults) -> frozenset[str]:
        works = other not in texts and await to_thread.run_sync(_is_beside, data, other)
        return frozenset({"disk"} if works else ())

    looks: list[Look] = [stored, parts, beside]
    if process == "runner":
        return FaultWatch(journal, receivers, looks, left=left)
    looks += [hung, CertificateLook(page).look]
    looks += [OwnCertificateLook(data).look] if tls else []
    return FaultWatch(journal, receivers, looks)


def _is_beside(data: Path, process: Process) -> bool:
    """Return whether a process serves a data folder on this computer."""
    try:
        address = served_address(data, process)
    except CannotStart:
        return False
    return address is not None and address.lives and address.is_here
