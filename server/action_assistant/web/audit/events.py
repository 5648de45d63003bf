"""The events of the stream `audit`: facts about people that no other stream holds.

Each process has such streams in its own log, one for each month, so that old months can be dropped. All
other facts of the audit are events of other streams, whose bodies hold the origin of their author
(`web/auth/caller.py`).
"""

from typing import ClassVar, Final, Literal, Protocol

import msgspec

from action_assistant.journal.events import Draft
from action_assistant.kit.moments import moment
from action_assistant.web.auth.caller import stamped
from action_assistant.web.auth.confirmations import ConfirmedBy
from action_assistant.web.auth.sessions import SignInMeans

#: The stream of the audit in the log of a process, from before there was one for each month.
STREAM: Final = "audit"
#: The stream of what was dropped and what must not be. It is never dropped itself.
KEEPING: Final = "audit-keeping"


def stream_at(at: int) -> str:
    """Return the name of the stream for facts at a time (µs UTC): that of its month."""
    return f"{STREAM}/{moment(at):%Y-%m}"


def is_of_month(stream: str) -> bool:
    """Return whether a stream holds facts of the audit that may be dropped when they are old."""
    return stream == STREAM or stream.startswith(f"{STREAM}/")


def is_audit(stream: str) -> bool:
    """Return whether a stream holds facts of the audit alone."""
    return stream == KEEPING or is_of_month(stream)


class EditingBegan(msgspec.Struct, frozen=True):
    """The author began to edit the document of a graph by a connection; `seq` is the first edit.
    Later edits of the author are by the same connection, up to the next event of this kind."""

    kind: ClassVar[str] = "audit.edited.v1"

    graph: str
    seq: int


class SignedIn(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author signed in. `invitation`: the id of the link, if it was by one."""

    kind: ClassVar[str] = "audit.signed_in.v1"

    how: SignInMeans
    role: str
    name: str
    session: str
    invitation: str = ""


class SessionEnded(msgspec.Struct, frozen=True, omit_defaults=True):
    """A session was ended. `own`: its person signed out; otherwise the author ended the session of
    somebody else."""

    kind: ClassVar[str] = "audit.session_ended.v1"

    session: str
    own: bool = False


class ViewLinkMade(msgspec.Struct, frozen=True):
    """The author made a link that shows one thing. `what`: graph or run; `thing`: its id; `expires`:
    microseconds UTC."""

    kind: ClassVar[str] = "audit.view_link_made.v1"

    link: str
    what: Literal["graph", "run"]
    thing: str
    label: str
    expires: int


class ViewLinkRevoked(msgspec.Struct, frozen=True):
    """The author revoked a link that showed one thing."""

    kind: ClassVar[str] = "audit.view_link_revoked.v1"

    link: str
    what: Literal["graph", "run"]
    thing: str


class EndedHere(msgspec.Struct, frozen=True):
    """The author told this process that an invitation, session, person or token has ended, with its
    `id`. The editor's log has the end itself."""

    kind: ClassVar[str] = "audit.ended_here.v1"

    what: Literal["invitation", "session", "person", "token"]
    id: str


class OwnerDid(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author told this process the rules of graphs, or sent a test to the receiver `of`."""

    kind: ClassVar[str] = "audit.owner_did.v1"

    what: Literal["rules_told", "receiver_tested"]
    of: str = ""


class ReleaseTold(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author told this process that a version was released, or that its release was withdrawn."""

    kind: ClassVar[str] = "audit.release_told.v1"

    version: str
    withdrawn: bool = False


class PersonStored(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author told this process the present state of a person. `until`: seconds since 1970."""

    kind: ClassVar[str] = "audit.person_stored.v1"

    id: str
    name: str
    role: str
    groups: tuple[str, ...] = ()
    until: float | None = None


class Confirmed(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author confirmed that it is they who use the session `session`. `refused`: on another
    device of theirs they said that it is not."""

    kind: ClassVar[str] = "audit.confirmed.v1"

    session: str
    how: ConfirmedBy
    refused: bool = False


class PasskeyChanged(msgspec.Struct, frozen=True):
    """The author registered or removed one of their passkeys, or set after how many minutes they are
    asked again for what only owners do (`what` "asked"; `name` has the minutes)."""

    kind: ClassVar[str] = "audit.passkey_changed.v1"

    passkey: str
    name: str
    what: Literal["registered", "removed", "asked"]


class StartRefused(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The author asked for a start, a change, a go-on or an answer that was refused, with the reason `why`.
    `engines`: the robots, or the simulator; `times`: how often within a minute."""

    kind: ClassVar[str] = "audit.start_refused.v1"

    what: Literal["start", "change", "go_on", "answer"]
    why: str
    engines: tuple[str, ...] = ()
    graph: str = ""
    graph_name: str = ""
    version: str = ""
    run: str = ""
    times: int = 1


class StopPressed(msgspec.Struct, frozen=True, omit_defaults=True):
    """The author pressed Stop where nothing of this program's was going on: there is no run that
    could hold it. `robot`, `run`: what the Stop was for; everything, where both are empty. `times`:
    how often within a minute."""

    kind: ClassVar[str] = "audit.stop_pressed.v1"

    robot: str = ""
    run: str = ""
    times: int = 1


class StrangersRefused(msgspec.Struct, frozen=True):
    """Requests without valid credentials from one address were refused in one minute. `minute`: its
    begin, in microseconds UTC; `first`: method and path of the first request."""

    kind: ClassVar[str] = "audit.strangers_refused.v1"

    address: str
    minute: int
    count: int
    first: str


class Unlisted(msgspec.Struct, frozen=True):
    """Further facts of one kind that have no row of their own, since there were too many that day."""

    kind: ClassVar[str] = "audit.unlisted.v1"

    what: Literal["strangers_refused", "repeated", "lost"]
    count: int


class AuditDropped(msgspec.Struct, frozen=True):
    """All facts in one stream of the audit were dropped, since all were older than `days`. `since`,
    `until`: times of the oldest and the newest one, µs UTC; `seq`, `chain`: the number of the last one
    and the hash there, in hex, by which an export can be checked; `by`: the number of the event by
    which the stream was taken out of the log."""

    kind: ClassVar[str] = "audit.dropped.v1"

    stream: str
    rows: int
    since: int
    until: int
    seq: int
    chain: str
    by: int
    days: float


class AuditKept(msgspec.Struct, frozen=True):
    """The author keeps a run as an incident: no facts between two times (µs UTC) are dropped."""

    kind: ClassVar[str] = "audit.kept.v1"

    run: str
    since: int
    until: int


class AuditEvent(Protocol):
    """An event of the streams of the audit."""

    kind: ClassVar[str]


def draft_of(event: AuditEvent, author: str = "") -> Draft:
    """Encode an event of the audit for the journal. `author`: the id of a person; "" for strangers."""
    return Draft(event.kind, author, stamped(msgspec.json.encode(event), author))
