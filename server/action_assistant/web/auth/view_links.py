"""Links that show one graph or run, read-only, to people without a name.

`views/` in the data folder holds `ID.json` for each link, and `ID.used` with its openings. The key of
a link is `view_ID_SECRET`; its secret seals id, thing and end under the token of the server, and is
stored nowhere. The editor has the links of graphs, the runner those of runs, so that neither needs the
other to let somebody look. A link ends with its file, with the mark `view-ID` in `revoked/`, and by
itself.
"""

import hmac
import logging
import re
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import BadInput, Conflict, NotFound, Unauthenticated, Unavailable
from action_assistant.private_files import DamagedFile, make_folder, replace_file, sync
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.web.auth.access import over_view
from action_assistant.web.auth.identity import View, ViewKind
from action_assistant.web.auth.keys import SKEW_S, Keys, PersonRef
from action_assistant.web.auth.record_files import RecordFiles
from action_assistant.web.auth.revocations import Revocations

log: Final = logging.getLogger(__name__)

FOLDER: Final = "views"
DAYS: Final = 7.0
_MOST_DAYS: Final = 365.0
_MOST: Final = 500  # links of one process
_LABEL: Final = 60  # characters
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


class ViewLinks:
    """Makes, verifies and ends the links of one process, which show things of one kind."""

    def __init__(self, data: Path, keys: Keys, revoked: Revocations, kind: ViewKind) -> None:
        self.kind: Final = kind
        self._keys = keys
        self._revoked = revoked
        self._files = RecordFiles(data / FOLDER, ViewRecord, ViewUse, self._accepts, most=_MOST)

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
        record = self._files.get(name)
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
            make_folder(self._files.folder)
            replace_file(self._files.path(record.id), msgspec.json.encode(record))
            sync(self._files.folder)
        except OSError as error:
            raise Unavailable(
                f"The link cannot be stored in {self._files.folder}: {error.strerror}."
            ) from error
        return self._shown(record)

    def every(self, thing: str | None = None) -> list[ViewLink]:
        """Return the links that show something, the newest first; with `thing`, only those to it.
        Files of links that are over are deleted."""
        found = []
        for record in self._files.every():
            if record.expires.timestamp() <= time.time() or self._revoked.view_ended(record.id):
                self._forget(record.id)
            elif thing in {None, record.thing}:
                found.append(self._shown(record))
        return sorted(found, key=lambda each: each.made_at, reverse=True)

    def revoke(self, link: str) -> ViewRecord:
        """End a link, at once and for good, and return it. Raise NotFound if there is none; raise
        Unavailable if the disk could store neither the mark nor the removal of the file."""
        record = self._files.get(link) if _ID.fullmatch(link) else None
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
        """Count that somebody opened a link. Call it in the event loop."""
        before = self._use(view.id)
        self._files.note_use(view.id, ViewUse(before.count + 1, datetime.now(UTC)))

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

    def _use(self, link: str) -> ViewUse:
        uses = self._files.uses
        if link not in uses:
            stored = self._files.stored_use(link)
            if stored is None:
                return ViewUse()
            uses[link] = stored
        return uses[link]

    def _forget(self, link: str) -> bool:
        """Delete the files of a link; return whether that is certainly stored."""
        self._files.uses.pop(link, None)
        try:
            self._files.path(link).unlink(missing_ok=True)
            self._files.path(link, ".used").unlink(missing_ok=True)
            sync(self._files.folder)
        except OSError:
            return False
        return True

    def _accepts(self, link: str, record: ViewRecord) -> bool:
        if record.made_at.tzinfo is None or record.expires.tzinfo is None:
            raise DamagedFile("it has a time without a time zone")
        return (record.id, record.kind) == (link, self.kind)
