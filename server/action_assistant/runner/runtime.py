"""The means that the services of a runner share."""

import msgspec

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.workers.lanes import RunInWorker


class Runtime(msgspec.Struct, frozen=True):
    """The journal, the clock (microseconds UTC), the background tasks and the workers of a runner."""

    journal: RunnerJournal
    clock_us: ClockUs
    tasks: BackgroundTasks
    run_in_worker: RunInWorker
