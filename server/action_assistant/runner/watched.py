"""The runner as those see it who look after it: runs, stops, robots, live sockets."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from action_assistant.runner.api.run_metrics import RunMetrics
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.runs import views
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.monitoring.readiness import Parts
from action_assistant.web.monitoring.status import Activity, RobotLink
from action_assistant.web.monitoring.watched import Watched


class WatchedRunner(Watched):
    """An open runner."""

    def __init__(self, services: RunnerServices, folders: Mapping[str, Path]) -> None:
        self._control, self._hub = services.control, services.hub
        self._metrics = RunMetrics(services.control)
        super().__init__(services.journal, services.lanes, (self._metrics,), folders)

    def activity(self) -> Activity:
        """What goes on."""
        heard = self._control.robots.heard()
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
            runs=len(self._control.open),
            stops_unconfirmed=self._metrics.unconfirmed.total(),
            robots=robots,
        )

    async def parts(self) -> Parts:
        """Whether what happens is recorded, and whether registered robots can be reached from here."""
        unrecorded = [each for each in self._control.open.values() if not each.recorder.recorded]
        robots = self._control.robots
        return {
            "recording": f"{len(unrecorded)} runs are not being recorded" if unrecorded else None,
            "rclpy": robots.no_reach or None if robots.names else None,
        }

    def families(self) -> Iterator[Family]:
        """Runs, robots, and who watches them."""
        yield Family("live_sockets", "Pages that watch runs.", len(self._hub.boxes))
        yield from self._metrics.families()
