"""The editor as an application."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import anyio
from litestar import Litestar, Request
from litestar.types import ASGIApp, ControllerRouterHandler

from action_assistant import paths
from action_assistant.editor.api import (
    devices,
    doctor,
    drafts,
    drawing,
    editor,
    folders,
    graph_rights,
    graphs,
    history,
    inbox,
    invitations,
    library,
    members,
    packages,
    passkeys,
    provider,
    room,
    subgraphs,
    tokens,
    versions,
    view,
)
from action_assistant.editor.api.graph_guard import guarded
from action_assistant.editor.cluster.chores import CHORES, done_by_one
from action_assistant.editor.cluster.owners import Alone, Here, Owner, Owners
from action_assistant.editor.log import database_location, epochs
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people import audit_facts
from action_assistant.editor.people.identity_provider import IdentityProvider
from action_assistant.editor.people.people import People
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.editor.workers import EditorWorkers
from action_assistant.errors import BadInput, CannotStart
from action_assistant.journal.copies import before_upgrade
from action_assistant.journal.journal import Journal
from action_assistant.settings import EditorSettings
from action_assistant.sites import port_of
from action_assistant.web.audit.events import KEEPING, AuditKept, draft_of
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.audit.retention import AuditRetention, kept_for_incidents
from action_assistant.web.audit.routes import audit_routes, keeping_routes
from action_assistant.web.audit.rows import AuditFilter
from action_assistant.web.auth.confirmation_routes import confirmation_routes
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.desk import Desk
from action_assistant.web.auth.device_codes import DeviceCodes
from action_assistant.web.auth.keys import Keys, ScrapeToken, Session
from action_assistant.web.auth.login_codes import LoginCodes
from action_assistant.web.auth.passkeys import PasskeyFiles, Passkeys
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.provider_settings import provider_of
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.session_limits import limits_of
from action_assistant.web.auth.sessions import Sessions, session_routes
from action_assistant.web.auth.standing import Standings
from action_assistant.web.auth.tokens import TokenFiles
from action_assistant.web.auth.view_links import ViewLinks
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.monitoring.monitoring import Monitoring, Watched
from action_assistant.web.monitoring.status import Activity
from action_assistant.web.network.addresses import Addresses, addresses_of
from action_assistant.web.notifications.receivers import receivers_of
from action_assistant.web.notifications.routes import notification_routes
from action_assistant.web.server.application import Application, application
from action_assistant.web.workers.lanes import run_here

if TYPE_CHECKING:  # slow to load, and one editor alone does without
    from action_assistant.editor.cluster.peers import Peers

log: Final = logging.getLogger(__name__)

#: Bytes of a body, but where a route says that it takes files.
SMALL: Final = 100_000


@asynccontextmanager
async def open_services(
    settings: EditorSettings,
    revoked: Revocations | None = None,
    audit: AuditLog | None = None,
    people_files: PeopleFiles | None = None,
    owners: Owners | None = None,
    give_up: Callable[[CannotStart], object] = log.error,
) -> AsyncIterator[EditorServices]:
    """Return a context with the services of the editor, without its HTTP side; they are closed at
    its end. `revoked`: the revoked sessions and links, None to read them; `give_up`: called with
    the reason if the editor has to end. Raise CannotStart if the database cannot be used."""
    revoked = revoked or Revocations(settings.data)
    journal = await Journal.open(
        settings.database,
        branch="editor",
        fold=h.fold,
        at_once=True,
        several=settings.cluster is not None,
    )
    try:
        # Ours from here on; until now `move` may have taken the graphs elsewhere.
        await asyncio.to_thread(
            database_location.check,
            settings.data,
            settings.database,
            switch=settings.switch_database,
        )
        new = await journal.position() == 0
        async with (
            EditorWorkers.opened() as workers,
            _owners(settings, journal, owners, give_up) as owning,  # may be refused, so it is first
            epochs.living_in(journal, settings.data) as epoch,
        ):
            people = await People.known(journal)
            services = EditorServices(
                settings, journal, people, epoch, revoked, workers, audit, people_files, owning
            )
            try:
                await services.rights.refresh()
                async with (
                    services.invitations.opened(),
                    services.members.opened(),
                    services.token_log.opened(),
                    services.graph_checks.kept_up(),
                    services.audit.writing(journal),
                    _chores(services),
                ):
                    await services.versions.write_releases()
                    if new and isinstance(await owning.owner(CHORES), Here):
                        await _greet(services, paths.examples())
                    yield services
            finally:
                await services.rooms.close()
                if services.peers is not None:
                    await services.peers.aclose()
                if services.locks is not None:
                    await services.locks.aclose()
    finally:
        await journal.close()


@asynccontextmanager
async def _owners(
    settings: EditorSettings,
    journal: Journal,
    given: Owners | None,
    give_up: Callable[[CannotStart], object],
) -> AsyncIterator[Owners]:
    """Return a context with the owners of graphs: those that are given, or this editor alone, or several
    editors of one database."""
    if given is not None or settings.cluster is None:
        yield given or Alone()
        return
    from action_assistant.editor.cluster.same_folder import in_one_folder  # slow to load
    from action_assistant.editor.cluster.shared_owners import SharedOwners

    async with SharedOwners.joined(journal, settings.database, settings.cluster.url) as owners:
        await owners.require_same_token(Keys.of(settings.data).relay_key)
        async with in_one_folder(journal, settings.data, give_up):
            yield owners


@asynccontextmanager
async def _chores(services: EditorServices) -> AsyncIterator[None]:
    """Return a context during which one of all editors does what is done once: indexes, mentions, messages
    and the retention of the audit."""
    days = services.settings.audit_days

    @asynccontextmanager
    async def doing() -> AsyncIterator[None]:
        async with (
            services.change_index.kept_up(),
            services.inboxes.kept_up(),
            services.notifications.sending(),
            AuditRetention(services.journal, days, kept_for_incidents).sweeping(),
        ):
            yield

    if services.settings.cluster is None:
        async with doing():
            yield
        return
    from action_assistant.editor.cluster.others_changes import OthersChanges
    from action_assistant.editor.rooms.others_people import OthersPeople

    people = OthersPeople(services.journal, services.rooms)
    changes = OthersChanges(
        services.journal, services.refresh_people, services.rights.refresh, people.exchange
    )
    async with changes.taken_up(), done_by_one(services.owners, doing):
        yield


def create_app(settings: EditorSettings, owners: Owners | None = None) -> Application:
    """Return the editor as an ASGI application, and prepare its database. Raise CannotStart if the
    database or the data folder cannot be used."""
    database_location.check(settings.data, settings.database, switch=settings.switch_database)
    Journal.prepare(
        settings.database,
        "editor",
        copies=settings.data / before_upgrade.FOLDER,
        several=settings.cluster is not None,
    )
    database_location.check(settings.data, settings.database, switch=settings.switch_database)
    database_location.remember(settings.data, settings.database)
    receivers_of(settings.notifications)
    keys = Keys.of(settings.data)
    app_state = EditorState()
    revoked = Revocations(settings.data)
    people_files = PeopleFiles(settings.data)
    browsers = SessionFiles(settings.data, revoked)
    confirmations = Confirmations(settings.data, keys)
    confirmations.prune()
    session_limits = limits_of(settings.sessions)
    passkey_files = PasskeyFiles(settings.data)
    standings = Standings(
        people_files, browsers, session_limits, confirmations=confirmations, passkeys=passkey_files
    )
    browsers.every()  # forgets those that are over
    token_files = TokenFiles(settings.data, keys, revoked, most_days=settings.token_days)
    view_links = ViewLinks(settings.data, keys, revoked, "graph")
    desk = _desk(app_state, settings, keys)
    codes = desk.hold(DeviceCodes(limits=settings.limits))
    addresses = _addresses(settings)
    public = settings.reached.public
    page = public.page if public is not None else ""
    monitoring = Monitoring("editor", settings.data, page=page, tls=settings.tls)
    audit = AuditLog()
    monitoring.requests.refused_stranger = audit.refused_stranger

    @asynccontextmanager
    async def lifespan(_: Litestar) -> AsyncIterator[None]:
        async with open_services(
            settings, revoked, audit, people_files, owners, made.give_up
        ) as services:
            app_state.open(services)
            async with monitoring.watching(WatchedEditor(services)):
                yield

    async def device_added(session: Session, browser: str, address: str) -> None:
        members = app_state.services.members
        await members.device_added(session.person.id, session.id, browser, address)

    sessions = Sessions(
        keys,
        settings.port,
        lambda: app_state.services.reception,
        revoked,
        standings,
        addresses=addresses,
        limits=settings.limits,
        audit=audit,
    )
    signing_in = session_routes(
        sessions, revoked=revoked, standings=standings, codes=codes, device_added=device_added
    )
    known_at = provider_of(settings.oidc)
    by_provider = provider.ProviderSignIn(
        None if known_at is None else IdentityProvider(known_at),
        app_state,
        sessions,
        keys,
        settings.port,
        addresses,
        browsers,
        confirmations,
        audit,
        desk.hold(provider.AnsweredStates()),
    )
    made = application(
        [
            *signing_in,
            *provider.routes(by_provider),
            *_routes(app_state, addresses, browsers),
            *notification_routes(lambda: app_state.services.notifications, audit.receiver_tested),
            *devices.routes(codes, browsers, addresses, audit, keys),
            *confirmation_routes(confirmations, limits=settings.limits),
            *passkeys.routes(desk.hold(Passkeys(passkey_files), slow=True), confirmations, audit),
            *tokens.routes(app_state, token_files, desk.hold(LoginCodes()), limits=settings.limits),
            *view.routes(app_state, view_links, addresses, audit, settings.frames),
            *doctor.routes(settings),
        ],
        title="TeMoto Action Assistant: editor",
        keys=keys,
        revoked=revoked,
        addresses=addresses,
        page_port=settings.port,
        lifespan=[lifespan],
        monitoring=monitoring,
        scraped=ScrapeToken(settings.metrics_token),
        standings=standings,
        tokens=token_files,
        views=view_links,
        frames=settings.frames,
        page=paths.page(),
        help_site=paths.help_site(),
        runner_port=settings.runner_port,
        more_runners=[port for each in settings.sites[1:] if (port := port_of(each)) is not None],
        mount=settings.reached.public.path if settings.reached.public is not None else "",
        body_limit=SMALL,
        relay=None if settings.cluster is None else partial(_relaying, app_state),
    )
    if settings.cluster is not None:
        made.entrance = _entrance(app_state, made, keys, settings.cluster.url, desk)
        made.drain = lambda: app_state.services.rooms.drain()
    return made


def _relaying(app_state: EditorState, app: ASGIApp) -> ASGIApp:
    """Return an application that relays what is of graphs of other editors, and passes the rest to `app`."""
    from action_assistant.editor.cluster.relay import Relay  # slow to load

    def owned(stream: str) -> AbstractAsyncContextManager[Owner]:
        return app_state.services.rooms.owned(stream)

    return Relay(app, owned, lambda: _peers(app_state))


def _peers(app_state: EditorState) -> "Peers":
    found = app_state.services.peers
    if found is None:
        raise RuntimeError("this editor is the only one")
    return found


def _desk(app_state: EditorState, settings: EditorSettings, keys: Keys) -> Desk:
    if settings.cluster is None:
        return Desk()
    from action_assistant.editor.cluster.shared_desk import SharedDesk  # slow to load

    return SharedDesk(lambda: app_state.services.owners, lambda: _peers(app_state), keys.relay_key)


def _entrance(
    app_state: EditorState, made: Application, keys: Keys, url: str, desk: Desk
) -> ASGIApp:
    from action_assistant.editor.api.entrance import Entrance  # slow to load
    from action_assistant.editor.cluster.relay_seal import RelaySeal
    from action_assistant.editor.cluster.shared_desk import SharedDesk

    if not isinstance(desk, SharedDesk):
        raise TypeError("nobody else asks the only editor")
    seal = RelaySeal(keys.relay_key)
    return Entrance(made.access.relayed, url, seal, lambda: app_state.services.rooms, desk)


def _addresses(settings: EditorSettings) -> Addresses:
    return addresses_of(
        host=settings.host,
        page_port=settings.port,
        hosts=settings.hosts,
        share=settings.share,
        secure=settings.tls,
        public=settings.reached.public,
    )


def _routes(
    app_state: EditorState, addresses: Addresses, browsers: SessionFiles
) -> list[ControllerRouterHandler]:
    return [
        *invitations.routes(app_state, addresses, browsers),
        *members.routes(app_state, addresses, browsers),
        *guarded(_graph_routes(app_state, addresses), app_state),
        *audit_routes(lambda wanted: _audit(app_state.services, wanted)),
        *keeping_routes(partial(_keep_audit, app_state)),
    ]


def _graph_routes(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    return [
        *editor.routes(app_state, addresses),
        *graphs.routes(app_state),
        *folders.routes(app_state),
        *graph_rights.routes(app_state),
        *history.routes(app_state),
        *inbox.routes(app_state),
        *versions.routes(app_state),
        *subgraphs.routes(app_state),
        *drafts.routes(app_state),
        *drawing.routes(app_state),
        *packages.routes(app_state),
        *library.routes(app_state),
        *room.routes(app_state),
    ]


async def _audit(services: EditorServices, wanted: AuditFilter) -> bytes:
    return await services.workers.graphs(
        audit_facts.page_in_worker, services.journal.address, wanted
    )


async def _keep_audit(
    app_state: EditorState, kept: AuditKept, request: Request[Any, Any, Any]
) -> None:
    services, person = await app_state.acting(request)
    await services.journal.append(KEEPING, [draft_of(kept, person.id)])


async def _greet(services: EditorServices, folder: Path) -> None:
    """Import the graphs in `folder`, which are shipped with the program, as examples. Call it only
    for a new catalogue. A file that cannot be read is logged and skipped."""
    files = [path async for path in anyio.Path(folder).glob("*.umrf.graph.json")]
    for path in sorted(files, reverse=True):  # the last one made stands first in the list
        try:
            # In this process: the files are small and ours, and there is no client yet who would wait.
            await services.catalogue.bring(
                await path.read_bytes(), h.EXAMPLES, run_in_worker=run_here
            )
        except BadInput as error:
            log.error("the example %s cannot be read: %s", path.name, error.detail)


class WatchedEditor(Watched):
    """Gives the metrics and the status of an open editor."""

    def __init__(self, services: EditorServices) -> None:
        workers, self._rooms = services.workers, services.rooms
        lanes = (workers.files, workers.edits, workers.graphs)
        super().__init__(
            services.journal,
            lanes,
            (services.rooms.metrics,),
            {},
            services.notifications.receivers,
        )

    def activity(self) -> Activity:
        """Return how many sockets and rooms of the editor are open."""
        rooms = self._rooms.open_rooms()
        return Activity(sockets=sum(len(room.members) for room in rooms), rooms=len(rooms))

    def families(self) -> Iterator[Family]:
        """Yield the metrics of the editor's rooms and their sockets."""
        now, metrics = self.activity(), self._rooms.metrics
        yield Family("rooms", "Graphs that somebody has open.", now.rooms or 0)
        yield Family("sockets", "Sockets in rooms.", now.sockets)
        yield Family("rooms_opened", "Rooms that were opened.", metrics.opened, (), "counter")
        yield Family("rooms_unloaded", "Rooms that were let go.", metrics.unloaded, (), "counter")
        yield Family(
            "updates_refused",
            "Edits that a room refused, by why.",
            {(why,): count for why, count in metrics.refused.items()},
            ("reason",),
            "counter",
        )
        yield Family(
            "sockets_closed",
            "Sockets in rooms that have ended, by close code.",
            {(str(code),): count for code, count in metrics.closed.items()},
            ("code",),
            "counter",
        )
        divergences = self._rooms.divergences
        told = "How often a page showed something else than its room."
        yield Family("divergences", f"{told} The former name of divergences_total.", divergences)
        yield Family("divergences", told, divergences, (), "counter")
