"""The events of graphs, versions and people: kinds, bodies, and the tables they fold into.

The stream `graph/ID` holds the document and nothing else, so that its `seq` counts changes of the
document. Everything else about a graph is in `about/ID`; names of people are in `people`, and
folders of graphs in `folders`.
"""

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal, TypeAlias, TypeVar

import msgspec
from sqlalchemy import Executable, ScalarSelect, delete, insert, select, update

from action_assistant.editor.log import inbox_events, people_events
from action_assistant.journal.events import Draft, Event
from action_assistant.kit.moments import moment
from action_assistant.schema import editor_tables
from action_assistant.web.auth.caller import stamped
from action_assistant.web.auth.graph_rules import Rule
from action_assistant.web.auth.roles import Role

UPDATED: Final = "graph.updated.v1"  # the body is the Yjs update as it came
DEFERRED: Final = "graph.deferred.v1"  # one that waits for others, which come later in the log


def when(at: int) -> datetime:
    """Return the datetime, in UTC, of a time in microseconds since 1970; see `kit/moments.py`."""
    return moment(at)


T = TypeVar("T")

CREATED: Final = "graph.created.v1"
IMPORTED: Final = "graph.imported.v1"  # the body is the file as it came
DESCRIBED: Final = "graph.described.v1"
RESTORED: Final = "graph.restored.v1"
REVERTED: Final = "graph.reverted.v1"
ADAPTED: Final = "graph.adapted.v1"
DRAFTED: Final = "graph.drafted.v1"
MERGED: Final = "graph.merged.v1"
PROPOSED: Final = "draft.proposed.v1"
WITHDRAWN: Final = "draft.withdrawn.v1"
ANSWERED: Final = "draft.answered.v1"
BUILT: Final = "action.built.v1"
DELETED: Final = "graph.deleted.v1"
RECOVERED: Final = "graph.recovered.v1"
PUBLISHED: Final = "version.published.v1"
RELEASED: Final = "version.released.v1"
RELEASE_WITHDRAWN: Final = "version.release_withdrawn.v1"
NAMED: Final = "person.named.v1"
INVITED: Final = "invitation.made.v1"
ACCEPTED: Final = "invitation.accepted.v1"
REVOKED: Final = "invitation.revoked.v1"
EPOCH: Final = "epoch.begun.v1"
FILED: Final = "graph.filed.v1"
FOLDER_MADE: Final = "folder.made.v1"
FOLDER_CHANGED: Final = "folder.changed.v1"
FOLDER_REMOVED: Final = "folder.removed.v1"
RULED: Final = "graph.ruled.v1"
FOLDER_RULED: Final = "folder.ruled.v1"

PEOPLE: Final = "people"
INVITATIONS: Final = "invitations"
FOLDERS: Final = "folders"
#: Not people: what this program does by itself, and the graphs that come with it.
SERVER: Final = "server"
EXAMPLES: Final = "examples"


#: The kinds of documents. The document of a library action holds that action alone.
DocumentKind: TypeAlias = Literal["graph", "action"]


class GraphCreated(msgspec.Struct, frozen=True):
    """A graph or action was created. `dialect` and `notes`: of the file it was read from, if any."""

    name: str
    description: str
    dialect: str | None = None
    notes: tuple[str, ...] = ()
    kind: DocumentKind = "graph"


class GraphDescribed(msgspec.Struct, frozen=True):
    """The name and description of a graph have changed in its document; noticed at `seq`."""

    name: str
    description: str
    seq: int


class GraphRestored(msgspec.Struct, frozen=True):
    """The edit `seq` restored the graph to its state after the change `restored`."""

    restored: int
    seq: int


class GraphReverted(msgspec.Struct, frozen=True):
    """The edit `seq` reverted what `author` had changed between `from_seq` and `upto`, except for
    what another person had changed since."""

    author: str
    from_seq: int
    upto: int
    seq: int


class GraphAdapted(msgspec.Struct, frozen=True):
    """The edit `seq` made parameters equal to another document: the uses of an action in a graph to
    the library, or an action of the library to its use or to a file. `source`: that document, ""
    for a file; `at`: the number (seq) of its change; `name`: the action."""

    seq: int
    source: str
    at: int
    name: str


class GraphDrafted(msgspec.Struct, frozen=True):
    """The graph was made as a draft, with the state of `origin` after its change `seq`, under the
    same keys."""

    origin: str
    seq: int
    name: str


class GraphMerged(msgspec.Struct, frozen=True):
    """The edit `seq` merged what `authors` had changed in the graph `source` from `from_seq` to
    `upto`. `draft`, `name`: the draft among the two graphs, and its name. `seq` 0: the merge
    changed nothing, since people chose so."""

    draft: str
    name: str
    source: str
    from_seq: int
    upto: int
    seq: int
    authors: tuple[str, ...]


class DraftProposed(msgspec.Struct, frozen=True):
    """The draft after its change `seq` was proposed to be merged. `device`: the browser of the
    person, "" if unknown."""

    note: str
    seq: int
    device: str = ""


class DraftAnswered(msgspec.Struct, frozen=True):
    """A proposal was answered with yes or no, for the draft after its change `seq`."""

    yes: bool
    note: str
    seq: int


class BuildFault(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An error of a compiler or of CMake. `file` is below the package, "" where none was named; `line`
    and `column` are from 1."""

    message: Annotated[str, msgspec.Meta(max_length=1000)]
    file: Annotated[str, msgspec.Meta(max_length=1000)]
    line: int | None
    column: int | None


class ActionBuilt(msgspec.Struct, frozen=True):
    """A build of the package of an action was reported; `at` is when it ended."""

    package: str
    ended_well: bool
    at: datetime
    errors: tuple[BuildFault, ...]


class PinnedSubgraph(msgspec.Struct, frozen=True):
    """A graph inside of a version, with its content at publication. `name`: of the actions that
    stand for it; `graph`: its id; `version`: its newest version with that content."""

    name: str
    version: str | None
    digest: str
    umrf: msgspec.Raw
    graph: str


class VersionPublished(msgspec.Struct, frozen=True):
    """A version was published: the graph at `seq`, as UMRF that never changes. `note`: by its
    author. `subgraphs`: all graphs inside, by name; `tree_digest`: of the graph together with
    them."""

    id: str
    label: str
    digest: str
    seq: int
    author_name: str
    umrf: msgspec.Raw
    note: str = ""
    subgraphs: tuple[PinnedSubgraph, ...] = ()
    tree_digest: str | None = None


class VersionReleased(msgspec.Struct, frozen=True):
    """An owner released the version `id`, or withdrew that: robots may demand it before a start."""

    id: str
    name: str


class GraphFiled(msgspec.Struct, frozen=True):
    """The graph was moved into a folder, or out of all folders (None)."""

    folder: str | None


class FolderState(msgspec.Struct, frozen=True):
    """The folder `id` was made, renamed or moved: it has this name and lies in `parent` from now
    on, or in no folder (None)."""

    id: str
    name: str
    parent: str | None


class FolderRemoved(msgspec.Struct, frozen=True):
    """The folder `id` was removed. Its graphs and folders went into the folder `into`; None: into
    no folder."""

    id: str
    into: str | None


class GraphRuled(msgspec.Struct, frozen=True):
    """An owner said who may see and edit the graph; None: as its folder says."""

    rule: Rule | None


class FolderRuled(msgspec.Struct, frozen=True):
    """An owner said who may see and edit the graphs in the folder `id`; None: as the folder around
    it says."""

    id: str
    rule: Rule | None


class PersonNamed(msgspec.Struct, frozen=True):
    """The author of the event has this name from now on."""

    name: str


class MadeInvitation(msgspec.Struct, frozen=True):
    """An invitation was made. Its secret is derived from `id` and the token."""

    id: str
    role: Role
    label: str = ""


class AcceptedInvitation(msgspec.Struct, frozen=True):
    """The author of the event came in by an invitation for the first time."""

    id: str
    name: str


class RevokedInvitation(msgspec.Struct, frozen=True):
    """An invitation was revoked, and all its sessions ended."""

    id: str


def graph_stream(graph: str) -> str:
    """Return the name of the stream that holds the edits of a graph's document."""
    return f"graph/{graph}"


def about_stream(graph: str) -> str:
    """Return the name of the stream that holds all events about a graph except the edits of its
    document."""
    return f"about/{graph}"


def graph_of(stream: str) -> str | None:
    """Return the graph to which a stream belongs; None for other streams."""
    head, _, graph = stream.partition("/")
    return graph if head in {"graph", "about"} else None


def draft(kind: str, author: str, body: msgspec.Struct | None = None) -> Draft:
    """Return an event to be stored, with the JSON of `body` (None: without a body), which holds the
    origin of the author if that is known."""
    encoded = msgspec.json.encode(body) if body is not None else b""
    return Draft(kind, author, stamped(encoded, author))


#: A NUL as JSON has it, after whole pairs of backslashes.
_NUL: Final = re.compile(rb"(?<!\\)((?:\\\\)*)\\u0000")


def _read(event: Event, kind: type[T]) -> T:
    """Decode the body of an event, of this type, for the tables. A NUL, which Postgres cannot store
    in a text, is replaced; the stored event keeps it."""
    body = event.body
    if b"\\u0000" in body:
        body = _NUL.sub(rb"\1\\ufffd", body)
    return msgspec.json.decode(body, type=kind)


def fold(event: Event) -> Sequence[Executable]:
    """Return the statements by which a stored event changes the tables."""
    if event.kind in {UPDATED, DEFERRED}:
        return inbox_events.due(event) if inbox_events.MARK in event.body else ()
    stream, _, name = event.stream.partition("/")
    if stream == "about":
        return _about(event, name)
    if event.kind == NAMED:
        named = _read(event, PersonNamed)
        row = {"id": event.author, "name": named.name, "seen_at": event.at}
        return [
            delete(editor_tables.person).where(editor_tables.person.c.id == event.author),
            insert(editor_tables.person).values(row),
        ]
    if event.stream == INVITATIONS:
        return _invitation(event)
    if event.kind == inbox_events.READ:
        return inbox_events.read(event)
    if event.stream == FOLDERS:
        return _folder(event)
    if event.stream == PEOPLE:
        return people_events.fold(event, _read)
    return ()


def _folder(event: Event) -> Sequence[Executable]:
    folder, graph = editor_tables.folder, editor_tables.graph
    match event.kind:
        case "folder.made.v1":
            made = _read(event, FolderState)
            row: dict[str, Any] = {
                "id": made.id,
                "name": made.name,
                "parent": _existing(made.parent),
                "made_at": event.at,
                "made_by": event.author,
            }
            return [insert(folder).values(row)]
        case "folder.changed.v1":
            now = _read(event, FolderState)
            this = update(folder).where(folder.c.id == now.id)
            return [this.values(name=now.name, parent=_existing(now.parent))]
        case "folder.ruled.v1":
            ruled = _read(event, FolderRuled)
            return [update(folder).where(folder.c.id == ruled.id).values(rule=_text(ruled.rule))]
        case "folder.removed.v1":
            gone = _read(event, FolderRemoved)
            into = _existing(gone.into)
            return [
                update(graph).where(graph.c.folder == gone.id).values(folder=into),
                update(folder).where(folder.c.parent == gone.id).values(parent=into),
                delete(folder).where(folder.c.id == gone.id),
            ]
        case _:
            return ()


def _text(rule: Rule | None) -> str | None:
    return None if rule is None else msgspec.json.encode(rule).decode()


def _existing(folder: str | None) -> ScalarSelect[str]:
    """Return the id of a folder as a query that gives NULL if there is no such folder. So no row
    refers to a folder that another person has just removed."""
    named = editor_tables.folder.alias("named")
    return select(named.c.id).where(named.c.id == folder).scalar_subquery()


def _invitation(event: Event) -> Sequence[Executable]:
    match event.kind:
        case "invitation.made.v1":
            made = _read(event, MadeInvitation)
            row: dict[str, Any] = {
                "id": made.id,
                "role": made.role,
                "label": made.label,
                "made_at": event.at,
                "made_by": event.author,
            }
            return [insert(editor_tables.invitation).values(row)]
        case "invitation.accepted.v1":
            came = _read(event, AcceptedInvitation)
            row = {
                "invitation": came.id,
                "person": event.author,
                "name": came.name,
                "at": event.at,
            }
            same = (
                editor_tables.guest.c.invitation == came.id,
                editor_tables.guest.c.person == event.author,
            )
            return [
                delete(editor_tables.guest).where(*same),
                insert(editor_tables.guest).values(row),
            ]
        case "invitation.revoked.v1":
            gone = _read(event, RevokedInvitation)
            this = update(editor_tables.invitation).where(editor_tables.invitation.c.id == gone.id)
            return [this.values(revoked_at=event.at, revoked_by=event.author)]
        case _:
            return ()


def _about(event: Event, graph: str) -> Sequence[Executable]:
    this = update(editor_tables.graph).where(editor_tables.graph.c.id == graph)
    match event.kind:
        case "graph.created.v1":
            created = _read(event, GraphCreated)
            row: dict[str, Any] = {
                "id": graph,
                "name": created.name,
                "description": created.description,
                "made_at": event.at,
                "made_by": event.author,
                "kind": created.kind,
            }
            return [insert(editor_tables.graph).values(row)]
        case "graph.described.v1":
            now = _read(event, GraphDescribed)
            return [this.values(name=now.name, description=now.description)]
        case "graph.drafted.v1":
            drafted = _read(event, GraphDrafted)
            base: dict[str, Any] = {"base_graph": drafted.origin, "base_seq": drafted.seq}
            of = {"draft_of": drafted.origin, "draft_name": drafted.name}
            return [this.values(**of, **base, drafted_seq=drafted.seq)]
        case "graph.filed.v1":
            return [this.values(folder=_existing(_read(event, GraphFiled).folder))]
        case "graph.ruled.v1":
            return [this.values(rule=_text(_read(event, GraphRuled).rule))]
        case "graph.merged.v1":
            return _merged(_read(event, GraphMerged))
        case "graph.deleted.v1":
            return [this.values(deleted_at=event.at)]
        case "graph.recovered.v1":
            return [this.values(deleted_at=None)]
        case "version.published.v1":
            return [insert(editor_tables.version).values(_version(event, graph))]
        case "version.released.v1" | "version.release_withdrawn.v1":
            return [_release(event)]
        case _:
            return ()


def _merged(merged: GraphMerged) -> Sequence[Executable]:
    """Return the statements that make the merged state the base of the next comparison."""
    draft = update(editor_tables.graph).where(editor_tables.graph.c.id == merged.draft)
    base: dict[str, Any] = {"base_graph": merged.source, "base_seq": merged.upto}
    if merged.source == merged.draft:
        base["merged_seq"] = merged.upto
    return [draft.values(base)]


def _release(event: Event) -> Executable:
    """Return the statement that marks a version as released, or as not released any more."""
    body = _read(event, VersionReleased)
    values: dict[str, Any] = dict.fromkeys(("released_at", "released_by", "released_by_name"))
    if event.kind == RELEASED:
        values = {
            "released_at": event.at,
            "released_by": event.author,
            "released_by_name": body.name,
        }
    version = editor_tables.version
    return update(version).where(version.c.id == body.id).values(values)


def _version(event: Event, graph: str) -> dict[str, Any]:
    version = _read(event, VersionPublished)
    return {
        "id": version.id,
        "graph": graph,
        "label": version.label,
        "note": version.note,
        "digest": version.digest,
        "tree_digest": version.tree_digest,
        "seq": version.seq,
        "author_id": event.author,
        "author_name": version.author_name,
        "at": event.at,
        "stream": event.stream,
        "event_seq": event.seq,
    }
