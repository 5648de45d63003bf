"""The services that the routes of the runner use."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final
from weakref import WeakKeyDictionary

from action_assistant.journal.journal import Journal
from action_assistant.runner.api.confirmation_requests import ConfirmationRequests
from action_assistant.runner.api.live import Hub
from action_assistant.runner.archives.retention import Retention
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.review.service import ReviewService
from action_assistant.runner.review.worker_queries import WorkerQueries
from action_assistant.runner.runs.photos import Photos
from action_assistant.runner.runs.sent_graphs import Sent
from action_assistant.runner.runs.sight import NO_RULES, RunSight
from action_assistant.runner.start.index_writer import IndexWriter
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.auth.released_versions import ReleasedVersions
from action_assistant.web.network.connection_limits import ConcurrencyLimit, ConnectionLimits
from action_assistant.web.notifications.sender import Notifications
from action_assistant.web.workers.lanes import Lane, RunInWorker

_BODIES: Final = 4  # large bodies of one person in memory at once


class RunnerServices:
    """The services that the routes use; set while the process starts, before the first request."""

    control: ExecutionService
    hub: Hub
    connection_limits: ConnectionLimits
    journal: Journal
    review_service: ReviewService
    worker_queries: WorkerQueries
    retention: Retention
    body_limit: ConcurrencyLimit
    run_in_worker: RunInWorker
    lanes: Sequence[Lane]
    behaviours: BehaviourFolder | None
    index_folders: Mapping[str, Path]
    index_writer: IndexWriter
    sent: WeakKeyDictionary[OpenRun, Sent]
    identity_now: IdentityNow
    released: ReleasedVersions
    notifications: Notifications
    photos: Photos
    repeats: Repeats
    queues: Queues
    sight: RunSight

    def __init__(self) -> None:
        self.behaviours = None
        self.identity_now = unchanged
        self.sight = NO_RULES
        self.index_folders = {}
        self.sent = WeakKeyDictionary()
        self.body_limit = ConcurrencyLimit(_BODIES)
        self.audit = AuditLog()
        self.requests = ConfirmationRequests()
