"""Listens to the health that robots report. It is shown, and asked about at a start: it closes no gate and
stops nothing. Stop itself knows nothing of this."""

import logging
from collections.abc import Callable
from typing import Final, TypeAlias

import anyio

from action_assistant.errors import NotFound, Refused
from action_assistant.runner.links.health import (
    HealthCheck,
    HealthKind,
    HealthNow,
    HealthSignal,
    health_now,
)
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runtime import Runtime

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 1.0
_PACE_S: Final = 0.2  # between two looks at least
_SHOWN_S: Final = 5.0  # the age that people see is behind by so much at most
_AGAIN_S: Final = 5.0
_NOT_YET: Final = "it is not listened to yet"

_Place: TypeAlias = tuple[str, tuple[HealthKind, str, str]]  # robot, and where it reports


class _Watched:
    """A report of a robot's health that is listened to. `place`: the registration of the robot, which says
    in which domain; `shown`: as people saw it last; `shown_at`: when the message of that came."""

    def __init__(self, place: Registration) -> None:
        self.place = place
        self.signal: HealthSignal | None = None
        self.problem = _NOT_YET
        self.shown: tuple[str, ...] = ()
        self.shown_at = 0.0


class HealthWatch:
    """Listens to the health of robots. `checks_of` returns what is checked of a robot; `changed` is
    called with a robot of which another thing is to be shown."""

    def __init__(
        self,
        robots: Robots,
        runtime: Runtime,
        checks_of: Callable[[str], tuple[HealthCheck, ...]],
        changed: Callable[[], None],
    ) -> None:
        self._robots = robots
        self._runtime = runtime
        self._checks_of = checks_of
        self._changed = changed
        self._watched: dict[_Place, _Watched] = {}
        self._news = anyio.Event()

    def of(self, robot: str) -> tuple[HealthNow, ...]:
        """Return the health of a robot now; empty where nothing of it is checked."""
        return tuple(self._now(robot, check) for check in self._checks_of(robot))

    def look(self) -> None:
        """Look again now: a rule has changed."""
        self._news.set()

    async def run(self) -> None:
        """Look at the health of all robots until cancelled; without a rule, wait for one."""
        while True:
            self._news = anyio.Event()
            try:
                has_rules = self._look()
            except Exception:  # the next look comes
                log.exception("the health of robots could not be looked at")
                has_rules = True
            with anyio.move_on_after(_POLL_S if has_rules else None):
                await self._news.wait()
            await anyio.sleep(_PACE_S)  # a robot may change as often as its publisher likes

    def _now(self, robot: str, check: HealthCheck) -> HealthNow:
        watched = self._watched.get((robot, check.source))
        newest, problem = None, _NOT_YET
        if watched is not None and self._is_so(robot, watched):
            newest = None if watched.signal is None else watched.signal.newest
            problem = watched.problem
        return health_now(robot, check, newest, problem, anyio.current_time())

    def _look(self) -> bool:
        wanted = {
            (name, check.source): check
            for name in self._robots.names
            for check in self._checks_of(name)
        }
        for key, known in tuple(self._watched.items()):
            if key not in wanted or not self._is_so(key[0], known):
                del self._watched[key]
                if known.signal is not None:
                    known.signal.close()
        is_news = False
        for (name, source), check in wanted.items():
            watched = self._watched.get((name, source))
            if watched is None:
                watched = self._watched[name, source] = _Watched(self._robots.registration(name))
                self._runtime.tasks.start_soon(self._listen, (name, source), watched, check)
            if watched.signal is not None:
                watched.problem = watched.signal.problem()
            is_news |= self._is_news(name, watched)
        if is_news:
            self._changed()
        return bool(wanted)

    def _is_news(self, robot: str, watched: _Watched) -> bool:
        """Return whether people have to see a robot anew."""
        shown = tuple(each.words for each in self.of(robot))
        newest = None if watched.signal is None else watched.signal.newest
        at = 0.0 if newest is None else newest[1]
        if shown == watched.shown and at - watched.shown_at < _SHOWN_S:
            return False
        watched.shown, watched.shown_at = shown, at
        return True

    def _is_so(self, robot: str, watched: _Watched) -> bool:
        """Return whether a robot is registered as it was when listening began."""
        try:
            return watched.place == self._robots.registration(robot)
        except NotFound:
            return False

    async def _listen(self, key: _Place, watched: _Watched, check: HealthCheck) -> None:
        while self._watched.get(key) is watched:
            try:
                signal = await self._robots.health_signal(key[0], check)
            except (RuntimeError, Refused) as error:  # without a link, a package, a domain
                watched.problem = str(error).rstrip(". ") or repr(error)
                await anyio.sleep(_AGAIN_S)
                continue
            if self._watched.get(key) is watched:
                watched.signal = signal
                self.look()
            else:
                signal.close()
            return
