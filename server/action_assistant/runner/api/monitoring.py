"""The runner as monitoring sees it: metrics of runs and robots, activity, and readiness."""

import logging
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final
from weakref import WeakKeyDictionary

from prometheus_client import Histogram, Metric
from prometheus_client.registry import Collector

from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import SIMULATOR
from action_assistant.runner.runs import views
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.monitoring.monitoring import Watched
from action_assistant.web.monitoring.readiness import Parts
from action_assistant.web.monitoring.status import Activity, RobotLink

log: Final = logging.getLogger(__name__)

_SENT: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5)
_PROVEN: Final = (0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 60, 300)
_UNCONFIRMED: Final = "stop_unconfirmed"


class StopTimes:
    """The times of one Stop of an open run: when it was requested (monotonic seconds), and which of
    its steps were counted."""

    def __init__(self) -> None:
        self.asked_at = time.monotonic()
        self.is_sent = self.is_proven = False


class RunMetrics(Collector):
    """Counts ends of runs, times Stops, and computes the gauges (present values) of runs and
    robots."""

    def __init__(self, control: ExecutionService) -> None:
        self._control = control
        self._stops: WeakKeyDictionary[OpenRun, StopTimes] = WeakKeyDictionary()
        self._over: WeakKeyDictionary[OpenRun, str] = WeakKeyDictionary()
        self._ended: Counter[tuple[str, str]] = Counter()
        self._sent = _histogram("send", "until the first message that stops it had left", _SENT)
        self._proven = _histogram("proof", "until it was proven that nothing moves", _PROVEN)
        control.watch(self._changed)

    def _changed(self, opened: OpenRun) -> None:
        try:
            self._note(opened)
        except Exception:  # a fault in counting must not end a run
            log.exception("run %s was not counted", opened.run.id)

    def _note(self, opened: OpenRun) -> None:
        run = opened.run
        if run.end is not None and self._over.get(opened) != run.end:
            self._over[opened] = run.end
            if not opened.is_led:  # a piece is a part of its run
                self._ended[run.engine, run.end] += 1
        if run.end is None:
            self._over.pop(opened, None)  # it moves again, and will end once more
        if run.desired != "stopped":
            return
        stop = self._stops.get(opened)
        if stop is None:
            stop = self._stops[opened] = StopTimes()
        if not stop.is_sent and run.stops_sent:
            stop.is_sent = True
            self._sent.observe(time.monotonic() - stop.asked_at)
        if not stop.is_proven and run.proof_at is not None:
            stop.is_proven = True
            self._proven.observe(time.monotonic() - stop.asked_at)

    def collect(self) -> Iterator[Metric]:
        """Yield the histograms of Stops, for the registry of prometheus_client."""
        yield from self._sent.collect()
        yield from self._proven.collect()

    def families(self) -> Iterator[Family]:
        """Yield the gauges of runs and robots with their present values."""
        yield from self._run_families()
        yield from self._stop_families()
        yield from self._robot_families()

    def _run_families(self) -> Iterator[Family]:
        opened, shown = tuple(self._control.open.values()), self._control.shown.values()
        open_runs = [each.run for each in shown if each.run.end is None]
        yield Family("runs_open", "Runs that are not over, or not stored yet.", len(shown))
        yield Family(
            "runs",
            "Runs that are not over, by engine and state.",
            Counter((run.engine, run.state) for run in open_runs),
            ("engine", "state"),
        )
        yield Family(
            "runs_ended",
            "Runs that have ended since this process began, by engine and how.",
            self._ended,
            ("engine", "end"),
            "counter",
        )
        unrecorded = sum(not each.recorder.recorded for each in opened)
        yield Family(
            "runs_unrecorded", "Open runs of which the newest facts are not stored.", unrecorded
        )
        waiting = sum(each.recorder.waiting for each in opened)
        waiting += self._control.robots.robot_log.waiting
        yield Family("facts_waiting", "Facts that were shown and are not stored yet.", waiting)

    @property
    def unconfirmed(self) -> Counter[str]:
        """The number of unconfirmed Stops by engine. Counted are open runs that are lost or have
        the alarm of an unconfirmed Stop, and graphs of other programs that are being stopped and
        for which a reason is known why rest is not proven."""
        open_runs = (each.run for each in self._control.open.values() if each.run.end is None)
        found = Counter(
            run.engine
            for run in open_runs
            if run.lost or any(alarm.code == _UNCONFIRMED for alarm in run.alarms)
        )
        for robot, why in self._control.foreign_stops.pending():
            found[robot] += bool(why)
        return found

    def _stop_families(self) -> Iterator[Family]:
        open_runs = (each.run for each in self._control.open.values() if each.run.end is None)
        engines = [SIMULATOR, *self._control.robots.names]
        stopping = Counter(run.engine for run in open_runs if run.desired == "stopped")
        stopping.update(robot for robot, _ in self._control.foreign_stops.pending())
        unconfirmed = self.unconfirmed
        yield Family(
            "stops_pending",
            "Stops that are wanted and not proven yet, of runs and of graphs of others.",
            {(name,): stopping[name] for name in engines},
            ("engine",),
        )
        yield Family(
            "stops_unconfirmed",
            "Those of them that the page calls STOP UNCONFIRMED: look at the robot.",
            {(name,): unconfirmed[name] for name in engines},
            ("engine",),
        )

    def _robot_families(self) -> Iterator[Family]:
        robots = self._control.robots
        yield Family(
            "engine_state",
            "1 for the state that an engine is in.",
            {(each.name, each.state): 1 for each in robots.all()},
            ("engine", "state"),
        )
        yield Family(
            "engine_last_answer_timestamp_seconds",
            "When an engine answered last; missing where it never did.",
            {(name,): at / 1e6 for name, at in robots.last_answers().items()},
            ("engine",),
        )


def _histogram(name: str, until: str, buckets: tuple[float, ...]) -> Histogram:
    return Histogram(
        f"action_assistant_stop_{name}_seconds",
        f"Time from the first Stop of a run {until}.",
        registry=None,
        buckets=buckets,
    )


class WatchedRunner(Watched):
    """An open runner, for monitoring."""

    def __init__(self, services: RunnerServices, folders: Mapping[str, Path]) -> None:
        self._control, self._hub = services.control, services.hub
        self._metrics = RunMetrics(services.control)
        super().__init__(
            services.journal,
            services.lanes,
            (self._metrics,),
            folders,
            services.notifications.receivers,
        )

    def activity(self) -> Activity:
        """Return how many pages, runs and unconfirmed Stops there are, and the state of each
        robot."""
        heard = self._control.robots.last_answers()
        robots = [
            RobotLink(
                each.name,
                each.state,
                each.why,
                views.time(heard[each.name]) if each.name in heard else None,
            )
            for each in self._control.robots.all()
            if not each.simulated
        ]
        return Activity(
            sockets=len(self._hub.boxes),
            runs=len(self._control.shown),
            stops_unconfirmed=self._metrics.unconfirmed.total(),
            robots=robots,
        )

    async def parts(self) -> Parts:
        """Return the parts that readiness depends on, each with its trouble or None: recording, and
        ROS 2 for registered robots."""
        unrecorded = [each for each in self._control.open.values() if not each.recorder.recorded]
        robots = self._control.robots
        return {
            "recording": f"{len(unrecorded)} runs are not being recorded" if unrecorded else None,
            "rclpy": robots.no_reach or None if robots.names else None,
        }

    def families(self) -> Iterator[Family]:
        """Yield the gauges of runs, robots and live sockets."""
        yield Family("live_sockets", "Pages that watch runs.", len(self._hub.boxes))
        yield from self._metrics.families()
