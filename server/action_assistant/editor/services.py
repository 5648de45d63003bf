"""The services of the editor process, and the state that its routes are given."""

from typing import TYPE_CHECKING, Any

from litestar import Request

from action_assistant.editor.catalogue.catalogue import Catalogue
from action_assistant.editor.catalogue.folders import Folders
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_pages import GraphPages
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.catalogue.graph_rights import GraphRights
from action_assistant.editor.catalogue.versions import Versions
from action_assistant.editor.cluster.locks import alone
from action_assistant.editor.cluster.owners import Alone, Owners
from action_assistant.editor.history.blame import Blame
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.course_search import CourseSearch
from action_assistant.editor.history.drafts.draft_merges import DraftMerges
from action_assistant.editor.history.drafts.drafts import Drafts
from action_assistant.editor.history.graph_history import GraphHistory
from action_assistant.editor.history.restoring import Restoring
from action_assistant.editor.inbox import KINDS, Inboxes
from action_assistant.editor.library.library import Library, LibraryEdits
from action_assistant.editor.people.invitations import Invitations
from action_assistant.editor.people.members import Members
from action_assistant.editor.people.people import People
from action_assistant.editor.people.reception import Reception
from action_assistant.editor.people.token_log import TokenLog
from action_assistant.editor.rooms.member import ByteRateLimits
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.presence import PersonColours
from action_assistant.editor.workers import EditorWorkers
from action_assistant.errors import NotFound
from action_assistant.journal.journal import Journal
from action_assistant.settings import EditorSettings
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.auth.access import person_of
from action_assistant.web.auth.graph_seals import RulesFile
from action_assistant.web.auth.identity import ANYBODY, Identity
from action_assistant.web.auth.keys import Keys, Person
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.released_versions import ReleasedVersions
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.network.connection_limits import ConnectionLimits
from action_assistant.web.notifications.messages import Message
from action_assistant.web.notifications.receivers import receivers_of
from action_assistant.web.notifications.sender import Notifications

if TYPE_CHECKING:  # slow to load, and one editor alone does without
    from action_assistant.editor.cluster.database_locks import DatabaseLocks
    from action_assistant.editor.cluster.peers import Peers


class EditorServices:
    """The services of the editor, built around an open journal."""

    def __init__(
        self,
        settings: EditorSettings,
        journal: Journal,
        people: People,
        epoch: str,
        revoked: Revocations,
        workers: EditorWorkers,
        audit: AuditLog | None = None,
        people_files: PeopleFiles | None = None,
        owners: Owners | None = None,
    ) -> None:
        keys = Keys.of(settings.data)
        self.settings = settings
        self.audit = audit or AuditLog()
        self.journal = journal
        self.epoch = epoch
        self.people = people
        self.workers = workers
        self.colours = PersonColours()
        self.owners: Owners = owners or Alone()
        self.peers = None if settings.cluster is None else _peers(self.owners, keys)
        self.rooms = Rooms(
            journal,
            run_in_worker=workers.graphs,
            tried=workers.edits,
            owners=self.owners,
            peers=self.peers,
        )
        self.locks = None if settings.cluster is None else _locks(settings.database)
        exclusively = alone if self.locks is None else self.locks.exclusively
        self.connection_limits = ConnectionLimits(limits=settings.limits, load=settings.load)
        self.rate_limits = ByteRateLimits(
            limits=settings.limits, per_minute=settings.load.mib_a_minute << 20
        )
        self.graph_reader = GraphReader(journal, self.rooms, workers.graphs)
        self.rights = GraphRights(journal, self.rooms, RulesFile(settings.data, keys), keys)
        self.graph_checks = GraphChecks(
            journal, self.rooms, self.graph_reader, self.rights.caller_sees, exclusively
        )
        self.catalogue = Catalogue(
            journal,
            self.rooms,
            self.graph_reader,
            self.graph_checks,
            workers.files,
            self.rights.made,
        )
        self.graph_pages = GraphPages(
            journal, self.rooms, self.graph_checks, self.rights, self.catalogue
        )
        self.folders = Folders(journal, self.rights)
        self.versions = Versions(
            journal, self.graph_reader, self.graph_checks, ReleasedVersions(settings.data)
        )
        self.library = Library(journal, self.graph_reader, self.rights.caller_sight)
        self.library_edits = LibraryEdits(
            journal, self.rooms, self.graph_reader, self.catalogue, self.library, workers.files
        )
        self.invitations = Invitations(journal, people, keys, revoked)
        self.members = Members(
            journal,
            people,
            keys,
            revoked,
            people_files or PeopleFiles(settings.data),
            settings.data,
        )
        self.reception = Reception(self.invitations, self.members)
        self.token_log = TokenLog(journal)
        self.change_index = ChangeIndex(journal, workers.graphs, exclusively)
        public = settings.reached.public
        receivers = receivers_of(settings.notifications, KINDS)
        self.notifications = Notifications(
            journal,
            receivers,
            KINDS,
            public.page if public is not None else "",
            self._is_seen_by_all,
        )
        self.inboxes = Inboxes(journal, self.change_index, receivers, may_see=self._may_see)
        self.history = GraphHistory(self.change_index)
        self.restoring = Restoring(
            journal, self.rooms, self.graph_reader, self.change_index, workers.graphs
        )
        self.course_search = CourseSearch(self.change_index, people, self.graph_checks)
        self.blame = Blame(self.change_index)
        self.drafts = Drafts(journal, self.graph_reader, self.catalogue, people, self.change_index)
        self.draft_merges = DraftMerges(
            journal, self.rooms, self.drafts, self.change_index, people, self.graph_checks
        )

    async def refresh_people(self) -> None:
        """Read again what another editor may have changed of persons and links. Raise Unavailable if the
        journal cannot be read."""
        await self.people.refresh()
        await self.invitations.refresh()
        await self.members.refresh()

    async def _is_seen_by_all(self, message: Message) -> bool:
        return await self.rights.may_see(str(message.facts["id"]), ANYBODY)

    async def _may_see(self, graph: str, person: str) -> bool:
        """Return whether a person may see a graph by their present role and groups. Somebody who came
        by a group link counts as a viewer; nobody who was ended sees any."""
        try:
            member = self.members.get(person)
        except NotFound:
            return await self.rights.may_see(graph, Identity(Person(person, "", "viewer")))
        identity = Identity(Person(person, member.name, member.role), frozenset(member.groups))
        return member.ended_at is None and await self.rights.may_see(graph, identity)


def _peers(owners: Owners, keys: Keys) -> "Peers":
    from action_assistant.editor.cluster.peers import Peers
    from action_assistant.editor.cluster.relay_seal import RelaySeal

    return Peers(owners, RelaySeal(keys.relay_key))


def _locks(database: str) -> "DatabaseLocks":
    from action_assistant.editor.cluster.database_locks import DatabaseLocks

    return DatabaseLocks(database)


class EditorState:
    """Holds the services once they are open, since routes are made before the journal is opened."""

    def __init__(self) -> None:
        self._services: EditorServices | None = None

    def open(self, services: EditorServices) -> None:
        """Set the services, so that requests can be answered from now on."""
        self._services = services

    @property
    def services(self) -> EditorServices:
        """Return the services that requests use. Raise RuntimeError if `open` was not called
        before."""
        if self._services is None:
            raise RuntimeError("the editor is not open yet")
        return self._services

    async def acting(self, request: Request[Any, Any, Any]) -> tuple[EditorServices, Person]:
        """Store the name of the person who sent a request, and return the services and this person.
        Raise Unavailable if the name cannot be stored."""
        person = person_of(request)
        await self.services.people.seen(person)
        return self.services, person
