"""Links that show one graph or run, read-only, to people without a name.

`views/` in the data folder holds `ID.json` for each link, and `ID.used` with its openings. The key of
a link is `view_ID_SECRET`; its secret seals id, thing and end under the token of the server, and is
stored nowhere. The editor has the links of graphs, the runner those of runs, so that neither needs the
other to let somebody look. A link ends with its file, with the mark `view-ID` in `revoked/`, and by
itself.
"""

import asyncio
import contextlib
import hmac
import logging
import re
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from action_assistant.errors import BadInput, Conflict, NotFound, Unauthenticated, Unavailable
from action_assistant.private_files import (
    DamagedFile,
    FileState,
    log_unreadable,
    make_folder,
    read_json,
    replace_file,
    state_of,
    sync,
)
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.web.auth.access import over_view
from action_assistant.web.auth.identity import View, ViewKind
from action_assistant.web.auth.keys import SKEW_S, Keys, PersonRef
from action_assistant.web.auth.revocations import Revocations

log: Final = logging.getLogger(__name__)

FOLDER: Final = "views"
DAYS: Final = 7.0
_MOST_DAYS: Final = 365.0
_MOST: Final = 500  # links of one process
_LABEL: Final = 60  # characters
_USE_S: Final = 60.0  # between two writes of the openings of one link
_PREFIX: Final = "view_"
_KEY: Final = re.compile(r"view_([A-Za-z0-9]{12})_([A-Za-z0-9_-]{43})")
_ID: Final = re.compile(r"[A-Za-z0-9]{12}")


class ViewRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A link as its file has it, without the secret."""

    id: str
    kind: ViewKind
    thing: str
    label: str
    made_by: PersonRef
    made_at: datetime
    expires: datetime


class ViewUse(msgspec.Struct, frozen=True):
    """The openings of a link: how many, and when the last one was. Up to a minute old after a crash."""

    count: int = 0
    at: datetime | None = None


class ViewLink(ViewRecord, frozen=True, kw_only=True):
    """A link as owners see it. `path` follows the address of the page, and holds the secret.
    `opened`: how often somebody opened it, `opened_at` the last time."""

    path: str
    opened: int
    opened_at: datetime | None


class _Read(NamedTuple):
    state: FileState
    record: ViewRecord | None


class ViewLinks:
    """Makes, verifies and ends the links of one process, which show things of one kind."""

    def __init__(self, data: Path, keys: Keys, revoked: Revocations, kind: ViewKind) -> None:
        self.kind: Final = kind
        self._folder = data / FOLDER
        self._keys = keys
        self._revoked = revoked
        self._known: dict[str, _Read] = {}
        self._uses: dict[str, ViewUse] = {}
        self._written: dict[str, float] = {}  # the last write of openings, on the monotonic clock

    def opens(self, text: str) -> View | None:
        """Return what the link with the key `text` shows; None if `text` does not have the prefix
        of such keys. Raise Withdrawn if the link was revoked, Unauthenticated if the key is
        malformed or unknown, or if the link has expired."""
        if not text.startswith(_PREFIX):
            return None
        found = _KEY.fullmatch(text)
        if found is None:
            raise Unauthenticated("This link was cut short or mistyped.")
        name, secret = found.groups()
        if self._revoked.view_ended(name):
            raise over_view(is_revoked=True)
        record = self._record(name)
        if record is None or not hmac.compare_digest(secret, self._secret(record)):
            raise Unauthenticated("This link is not known here. Ask for another one.")
        view = View(record.id, record.kind, record.thing, record.expires.timestamp())
        if view.expired or record.made_at.timestamp() > time.time() + SKEW_S:  # it was set back
            raise over_view(is_revoked=False)
        return view

    def make(self, thing: str, label: str, days: float, by: PersonRef) -> ViewLink:
        """Make a link that shows the thing with this id, and store it durably. Raise BadInput for a
        bad label or number of days, Conflict if there are too many, Unavailable if the disk cannot
        take it."""
        label = " ".join(label.split())
        if len(label) > _LABEL or (label and not is_name(label)):
            raise BadInput(f"A label has up to {_LABEL} characters.", where={"path": "/label"})
        if not 0 < days <= _MOST_DAYS:
            raise BadInput(f"A link lasts up to {_MOST_DAYS:.0f} days.", where={"path": "/days"})
        if len(self.every()) >= _MOST:
            raise Conflict(f"There are {_MOST} links already; revoke some.")
        now = datetime.now(UTC)
        record = ViewRecord(
            id=random_id(),
            kind=self.kind,
            thing=thing,
            label=label,
            made_by=PersonRef(by.id, by.name),
            made_at=now,
            expires=(now + timedelta(days=days)).replace(microsecond=0),
        )
        try:
            make_folder(self._folder)
            replace_file(self._path(record.id), msgspec.json.encode(record))
            sync(self._folder)
        except OSError as error:
            raise Unavailable(
                f"The link cannot be stored in {self._folder}: {error.strerror}."
            ) from error
        return self._shown(record)

    def every(self, thing: str | None = None) -> list[ViewLink]:
        """Return the links that show something, the newest first; with `thing`, only those to it.
        Files of links that are over are deleted."""
        found = []
        with contextlib.suppress(OSError):
            for path in list(self._folder.glob("*.json")):
                record = self._record(path.stem)
                if record is None:
                    continue
                if record.expires.timestamp() <= time.time() or self._revoked.view_ended(record.id):
                    self._forget(record.id)
                elif thing in {None, record.thing}:
                    found.append(self._shown(record))
        return sorted(found, key=lambda each: each.made_at, reverse=True)

    def revoke(self, link: str) -> ViewRecord:
        """End a link, at once and for good, and return it. Raise NotFound if there is none; raise
        Unavailable if the disk could store neither the mark nor the removal of the file."""
        record = self._record(link) if _ID.fullmatch(link) else None
        if record is None or self._revoked.view_ended(link):
            raise NotFound(f"There is no link {link!r}.")
        unwritten: Unavailable | None = None
        try:
            self._revoked.end_view(link)
        except Unavailable as error:
            unwritten = error
        if not self._forget(link) and unwritten is not None:
            raise unwritten
        log.info("link %s to a %s is revoked", link, record.kind)
        return record

    def note_opening(self, view: View) -> None:
        """Count that somebody opened a link. Written at most once a minute, on a thread. Call it in
        the event loop."""
        before = self._use(view.id)
        self._uses[view.id] = ViewUse(before.count + 1, datetime.now(UTC))
        now = time.monotonic()
        if now - self._written.get(view.id, -_USE_S) >= _USE_S:
            self._written[view.id] = now
            asyncio.get_running_loop().run_in_executor(None, self._write_use, view.id)

    def _secret(self, record: ViewRecord) -> str:
        sealed = (record.id, record.kind, record.thing, record.expires.isoformat())
        return self._keys.view_secret(msgspec.json.encode(sealed))

    def _shown(self, record: ViewRecord) -> ViewLink:
        use = self._use(record.id)
        return ViewLink(
            **msgspec.structs.asdict(record),
            path=f"/view#{record.kind}={_PREFIX}{record.id}_{self._secret(record)}",
            opened=use.count,
            opened_at=use.at,
        )

    def _record(self, link: str) -> ViewRecord | None:
        """Return the record of a link of this process, read anew if its file has changed; None
        without one. If the whole folder cannot be read, what was read before counts."""
        known = self._known.get(link)
        try:
            state = state_of(self._path(link))
            if known is None or known.state != state:
                if len(self._known) > 2 * _MOST:
                    self._known.clear()
                known = self._known[link] = _Read(state, self._read(link))
        except FileNotFoundError:
            if known is None or self._folder.is_dir():
                self._known.pop(link, None)
                return None
        except OSError:  # the disk is gone, for which nobody is put out
            pass
        return None if known is None else known.record

    def _read(self, link: str) -> ViewRecord | None:
        try:
            record = read_json(self._path(link), ViewRecord)
            if record.made_at.tzinfo is None or record.expires.tzinfo is None:
                raise DamagedFile("it has a time without a time zone")
        except DamagedFile as error:
            log_unreadable(self._path(link), error)
            return None
        return record if (record.id, record.kind) == (link, self.kind) else None

    def _use(self, link: str) -> ViewUse:
        if link not in self._uses:
            try:
                self._uses[link] = read_json(self._path(link, ".used"), ViewUse)
            except (OSError, DamagedFile):  # only a count is lost
                return ViewUse()
        return self._uses[link]

    def _write_use(self, link: str) -> None:
        use, path = self._uses.get(link), self._path(link, ".used")
        if use is None or not self._path(link).exists():  # it was revoked meanwhile
            return
        try:
            replace_file(path, msgspec.json.encode(use), is_durable=False)
        except OSError as error:
            log.warning("the openings of a link could not be noted: %s", error.strerror)

    def _forget(self, link: str) -> bool:
        """Delete the files of a link; return whether that is certainly stored."""
        self._uses.pop(link, None)
        try:
            self._path(link).unlink(missing_ok=True)
            self._path(link, ".used").unlink(missing_ok=True)
            sync(self._folder)
        except OSError:
            return False
        return True

    def _path(self, link: str, suffix: str = ".json") -> Path:
        return self._folder / f"{link}{suffix}"
