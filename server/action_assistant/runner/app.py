"""The runner process: its journal, its services, its routes.

What a Stop needs is imported here and by these imports, never at its first use: a Stop may be the
first request to a runner.
"""

import logging
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Final

import anyio
import msgspec
from litestar import Litestar

from action_assistant.journal.copies import before_upgrade
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import utc_us
from action_assistant.public_url import RUNNER
from action_assistant.runner import projection
from action_assistant.runner.api import view
from action_assistant.runner.api.caller import SMALL
from action_assistant.runner.api.confirmations import routes as device_confirmations
from action_assistant.runner.api.live import Hub
from action_assistant.runner.api.monitoring import WatchedRunner
from action_assistant.runner.api.run_guard import is_seen_by_all, is_waiting_seen_by_all
from action_assistant.runner.api.runs import routes
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.archives.retention import Retention
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.port import Reach
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.links.simulated import Simulators
from action_assistant.runner.notices import KINDS, with_notices
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.review.background_loops import index_words
from action_assistant.runner.review.incident import incident_times
from action_assistant.runner.review.service import ReviewService
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.review.worker_queries import StoragePaths, WorkerQueries
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs import photos, queries
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.photos import Photos
from action_assistant.runner.runs.sight import RunSight
from action_assistant.runner.start.index_writer import IndexWriter, folder_trouble
from action_assistant.runner.workers import RunnerWorkers
from action_assistant.settings import ARCHIVE, Keep, RunnerSettings
from action_assistant.web.audit.events import StopPressed
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.audit.retention import AuditRetention
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.auth.confirmation_routes import confirmation_routes
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, ScrapeToken
from action_assistant.web.auth.passkeys import PasskeyFiles
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.released_versions import ReleasedVersions
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.session_limits import limits_of
from action_assistant.web.auth.sessions import revocation
from action_assistant.web.auth.standing import Standings
from action_assistant.web.auth.token_routes import adoption, shared_token_routes
from action_assistant.web.auth.tokens import TokenFiles, TokenRecord
from action_assistant.web.auth.view_links import ViewLinks
from action_assistant.web.monitoring.monitoring import Monitoring
from action_assistant.web.network.addresses import addresses_of
from action_assistant.web.network.connection_limits import ConnectionLimits
from action_assistant.web.notifications.messages import Message
from action_assistant.web.notifications.receivers import receivers_of
from action_assistant.web.notifications.routes import notification_routes
from action_assistant.web.notifications.sender import Notifications
from action_assistant.web.server.application import Application, application

log: Final = logging.getLogger(__name__)

#: Seconds after which a thread gives up the interpreter, for which the event loop may be waiting.
_SWITCH_S: Final = 0.0005


@asynccontextmanager
async def open_services(
    settings: RunnerSettings, services: RunnerServices | None = None
) -> AsyncIterator[RunnerServices]:
    """Return a context in which all services of the routes are open; they are closed at its end.
    `services`: the object to fill, None for a new one. Raise CannotStart if the database or a
    folder cannot be used."""
    services = services or RunnerServices()
    if settings.behaviours is not None:
        services.behaviours = BehaviourFolder.opened(settings.behaviours)
    services.index_folders = settings.index_folders
    sys.setswitchinterval(_SWITCH_S)
    receivers = receivers_of(settings.notifications, KINDS)
    fold = with_notices(projection.fold, receivers)
    journal = await Journal.open(_database(settings), branch="runner", fold=fold)
    try:
        keep = _keep(settings)
        on_disk = anyio.to_thread.run_sync  # threads wait for disks; workers compute
        recordings = Recordings(_folders(settings)["recordings"], on_disk, prunes=keep.raw is None)
        archive_store = ArchiveStore(journal, keep.folder, on_disk)
        storage = StoragePaths(_file(settings), keep.folder)
        async with _executing(services, archive_store, recordings, storage) as control:
            services.connection_limits = ConnectionLimits(
                limits=settings.limits, load=settings.load, keeps_one=True
            )
            services.journal = journal
            services.review_service = ReviewService(
                archive_store, utc_us, services.worker_queries, control.next_number
            )

            services.photos = Photos(
                settings.data / photos.FOLDER, on_disk, partial(_answers_of, control)
            )

            def review(opened: OpenRun) -> None:
                services.photos.run_changed(opened.run)
                if not opened.is_led:  # a piece is a part of its run
                    services.review_service.run_changed(opened.run, opened.recorder)

            control.watch(review)
            services.retention = Retention(
                journal,
                recordings,
                keep,
                is_open=control.open.__contains__,
                clock_us=utc_us,
                run_in_worker=on_disk,
            )
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(services.review_service.run)
                tasks.start_soon(services.retention.run)
                tasks.start_soon(services.photos.run)
                tasks.start_soon(index_words, journal)
                public = settings.reached.public
                services.notifications = Notifications(
                    journal,
                    receivers,
                    KINDS,
                    public.page if public is not None else "",
                    partial(_is_seen_by_all, services),
                )
                control.idle_stop = partial(_note_idle_stop, services.audit)
                old_audit = AuditRetention(journal, settings.audit_days, incident_times)
                async with (
                    services.audit.writing(journal),
                    services.notifications.sending(),
                    old_audit.sweeping(),
                ):
                    yield services
                tasks.cancel_scope.cancel()
    finally:
        await journal.close()


async def _answers_of(control: ExecutionService, run: str) -> list[str]:
    """Return all answers of a run as JSON texts: those that are stored, and those that are just being."""
    await control.history.requested(run)  # it is in the journal, and not archived
    stored = await control.history.rows(queries.answers_of(run))
    opened = control.open.get(run)
    newest = {} if opened is None else opened.run.answers
    return [
        *(str(row.body) for row in stored),
        *(each.value for given in newest.values() for each in given),
    ]


def _identity_now(
    standings: Standings, revoked: Revocations, identity: Identity
) -> Identity | None:
    """Return an identity with the role and groups of its person now; None if it, or its person, was
    ended, or has expired. Without session and token it is that of the owner's token, or a person who
    is not here."""
    credential = identity.session or identity.token
    if credential is None:
        return None if revoked.person_ended(identity.person.id) else standings.known(identity)
    standing = standings.of(credential)
    if revoked.ends(credential) or standing.expired:
        return None
    return msgspec.structs.replace(
        identity,
        person=standing.person,
        groups=standing.groups,
        confirmed_at=standing.confirmed_at,
    )


async def _is_seen_by_all(services: RunnerServices, message: Message) -> bool:
    run, graph, entry = (str(message.facts.get(name, "")) for name in ("run", "id", "entry"))
    if entry:
        waiting = (each.graphs for each in services.queues.entries if each.id == entry)
        return is_waiting_seen_by_all(services, next(waiting, None))
    return await is_seen_by_all(services, run, graph)


async def _note_token(audit: AuditLog, record: TokenRecord, person: str) -> None:
    audit.ended_here("token", record.id, person)


def _note_idle_stop(audit: AuditLog, author: Author, robot: str, run: str) -> None:
    audit.note_repeated(StopPressed(robot, run), author.id)


@asynccontextmanager
async def _executing(
    services: RunnerServices,
    archive_store: ArchiveStore,
    recordings: Recordings,
    storage: StoragePaths,
) -> AsyncIterator[ExecutionService]:
    """Return a context in which workers, robots and the service that drives runs on them are open.
    Other services are set in `services`."""
    async with (
        RunnerWorkers.opened() as workers,
        _asking(workers, storage, archive_store) as queries,
    ):
        for_people, own = queries
        services.run_in_worker = workers.looks
        services.lanes = (workers.starts, workers.ours, workers.looks)
        reach = ros2_reach(utc_us)
        async with (
            _closing(reach),
            ExecutionService.opened(
                archive_store,
                Robots(reach=reach, recordings=recordings, indexing=services.index_folders),
                clock_us=utc_us,
                run_in_worker=workers.starts,
                simulator=Simulators(),
                sources=StartSources(
                    services.behaviours,
                    lambda *args: for_people.value(StoredRuns.checked_courses, *args),
                    services.index_folders,
                    services.released.of,
                    services.sight,
                ),
                # A run that moves again is read with all its visits, and waits behind no question.
                identity_now=services.identity_now,
                past=lambda run, is_whole: (own if is_whole else for_people).past(run, is_whole),
            ) as control,
            Repeats.opened(
                control, archive_store, clock_us=utc_us, run_in_worker=workers.starts
            ) as repeats,
            Queues.opened(
                control, archive_store, clock_us=utc_us, run_in_worker=workers.starts
            ) as queues,
        ):
            services.repeats, services.queues = repeats, queues
            for_people.recorder_of = own.recorder_of = control.recorder_of
            services.worker_queries, services.control = for_people, control
            services.hub = Hub(control, utc_us, services.requests, services.identity_now, queues)
            services.index_writer = IndexWriter(
                control.robots,
                services.index_folders,
                clock_us=utc_us,
                run_in_worker=workers.starts,
                on_disk=anyio.to_thread.run_sync,
            )
            yield control


@asynccontextmanager
async def _asking(
    workers: RunnerWorkers, storage: StoragePaths, archive_store: ArchiveStore
) -> AsyncIterator[tuple[WorkerQueries, WorkerQueries]]:
    """Return a context with two services for questions about stored runs: one for people, and one
    for the runner itself, whose questions never wait behind those of people."""
    async with anyio.create_task_group() as tasks:
        background = BackgroundTasks(tasks)
        yield (
            WorkerQueries(workers.looks, storage, archive_store, background),
            WorkerQueries(workers.ours, storage, archive_store, background),
        )
        tasks.cancel_scope.cancel()


@asynccontextmanager
async def _closing(reach: Reach | str) -> AsyncIterator[None]:
    """Return a context that closes the robots' `reach` at its end; a text (why there is none) needs
    no closing."""
    try:
        yield
    finally:
        if not isinstance(reach, str):
            await reach.aclose()


def _file(settings: RunnerSettings) -> Path:
    return settings.data / "runner.db"


def _keep(settings: RunnerSettings) -> Keep:
    return settings.keep or Keep(folder=settings.data / ARCHIVE)


def _folders(settings: RunnerSettings) -> dict[str, Path]:
    """Return the folders of the runner's files (archive, recordings), by their use."""
    return {"archive": _keep(settings).folder, "recordings": settings.data / "recordings"}


def _database(settings: RunnerSettings) -> str:
    return f"sqlite:///{_file(settings)}"


def create_app(settings: RunnerSettings) -> Application:
    """Return the runner as an ASGI application, and prepare its database. Raise CannotStart if the
    database, the folder of behaviours or the file of notifications cannot be used."""
    if settings.behaviours is not None:
        BehaviourFolder.opened(settings.behaviours)
    for robot, folder in settings.index_folders.items():
        # This concerns one robot only, and the folder may appear later: the runner starts.
        if why := folder_trouble(robot, folder):
            log.warning("%s Graphs cannot be written there until it can be read.", why)
    Journal.prepare(_database(settings), "runner", copies=settings.data / before_upgrade.FOLDER)
    receivers_of(settings.notifications)
    revoked = Revocations(settings.data)
    services = RunnerServices()
    services.released = ReleasedVersions(settings.data)
    public = settings.reached.public
    monitoring = Monitoring("runner", settings.data)
    monitoring.requests.refused_stranger = services.audit.refused_stranger

    @asynccontextmanager
    async def lifespan(_: Litestar) -> AsyncIterator[None]:
        async with (
            open_services(settings, services),
            monitoring.watching(WatchedRunner(services, _folders(settings))),
        ):
            yield

    keys = Keys.of(settings.data)
    tokens = TokenFiles(settings.data, keys, revoked)
    view_links = ViewLinks(settings.data, keys, revoked, "run")
    people_files = PeopleFiles(settings.data)
    browsers = SessionFiles(settings.data, revoked)
    confirmations = Confirmations(settings.data, keys)
    confirmations.prune()
    limits = limits_of(settings.sessions)
    passkey_files = PasskeyFiles(settings.data)
    standings = Standings(
        people_files, browsers, limits, confirmations=confirmations, passkeys=passkey_files
    )
    services.identity_now = partial(_identity_now, standings, revoked)
    services.sight = RunSight(settings.data, keys)
    return application(
        [
            *routes(services),
            *view.routes(services, view_links),
            *revocation(keys, revoked, people_files, services.audit, limits=settings.limits),
            *shared_token_routes(tokens, revoked=partial(_note_token, services.audit)),
            *notification_routes(lambda: services.notifications, services.audit.receiver_tested),
            *adoption(tokens, limits=settings.limits),
            *confirmation_routes(confirmations, limits=settings.limits),
            *device_confirmations(services, confirmations),
        ],
        title="TeMoto Action Assistant: runner",
        keys=keys,
        revoked=revoked,
        addresses=addresses_of(
            host=settings.host,
            page_port=settings.page_port,
            hosts=settings.hosts,
            share=settings.share,
            secure=settings.tls,
            public=public,
        ),
        page_port=settings.page_port,
        lifespan=[lifespan],
        monitoring=monitoring,
        scraped=ScrapeToken(settings.metrics_token),
        standings=standings,
        tokens=tokens,
        views=view_links,
        mount=public.path + RUNNER if public is not None else "",
        body_limit=SMALL,
    )
