"""Acts on hardware stops that robots report: while one counts as pressed nothing starts there, and when it
begins to, what goes on there is stopped.

Stop itself knows nothing of this. What nobody hears counts as pressed: no publisher, another type, no
message, or one that is too old.
"""

import logging
from collections.abc import Callable
from typing import Final

import anyio

from action_assistant.errors import NotFound, Refused
from action_assistant.runner.links.hardware_stop import HardwareStop, StopSignal
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runtime import Runtime

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 0.1  # between two looks at the age of messages
_PROBLEM_S: Final = 1.0  # between two looks at who publishes
_BEGIN_S: Final = 5.0  # discovery may take so long: until then silence blocks, and stops nothing
_STALL_S: Final = 0.5  # between two looks: this process stood still, and messages may wait
_AGAIN_S: Final = 5.0


class _Watched:
    """A hardware stop that is listened to since `since`, in monotonic seconds. `place`: the registration of
    its robot, which says in which domain. `is_told`: it counts as pressed, and that was acted on; `knew`:
    what runs on the robot was known then; `presses`: those acted on; `was_clear`: it did not count
    as pressed at some time; `shown`: why, as it was shown."""

    def __init__(self, place: Registration, rule: HardwareStop, since: float) -> None:
        self.robot, self.place, self.rule, self.since = place.name, place, rule, since
        self.signal: StopSignal | None = None
        self.presses = 0
        self.knew = False
        self.problem = "it is not listened to yet"
        self.looked_at = since - _PROBLEM_S
        self.is_told = self.was_clear = False
        self.shown = ""

    def why(self, now: float) -> str:
        """Return why it counts as pressed, as a sentence; "" if it does not."""
        name, topic = f"The hardware stop of {self.robot}", self.rule.full_topic
        signal = self.signal
        if signal is not None and signal.pressed:
            return f"{name} is pressed ({topic})."
        if self.problem:
            return f"{name} counts as pressed: {self.problem} ({topic})."
        if signal is None or signal.pressed is None:
            return f"{name} counts as pressed: no message has come on {topic}."
        if now - signal.at > self.rule.age_s:
            return f"{name} counts as pressed: the last message on {topic} is older than {self.rule.age_s:g} s."
        return ""

    @property
    def signal_says_pressed(self) -> bool:
        """True if the newest message means pressed."""
        return self.signal is not None and self.signal.pressed is True

    def counts(self, now: float) -> bool:
        """Return whether what counts as pressed stops the robot too: not silence at the begin."""
        return (
            self.signal_says_pressed
            or self.was_clear
            or now - self.since >= max(_BEGIN_S, self.rule.age_s)
        )


class HardwareStops:
    """Listens to the hardware stops of robots. `rule_of` returns that of a robot, None for none;
    `pressed` is called with a robot and the reason in the step in which it begins to count as pressed;
    `changed` with a robot of which another thing is to be shown."""

    def __init__(
        self,
        robots: Robots,
        runtime: Runtime,
        rule_of: Callable[[str], HardwareStop | None],
        pressed: Callable[[str, str], None],
        changed: Callable[[str], None],
    ) -> None:
        self._robots = robots
        self._runtime = runtime
        self._rule_of = rule_of
        self._pressed = pressed
        self._changed = changed
        self._watched: dict[str, _Watched] = {}
        self._news = anyio.Event()

    def why(self, robot: str) -> str:
        """Return why the hardware stop of a robot counts as pressed now, as a sentence; "" if it does
        not, or the robot reports none."""
        rule = self._rule_of(robot)
        if rule is None:
            return ""
        watched = self._watched.get(robot)
        if watched is None or not self._is_so(watched, rule):
            return f"The hardware stop of {robot} counts as pressed: it is not listened to yet."
        return watched.why(anyio.current_time())

    def look(self) -> None:
        """Look again now: a rule or a message has changed."""
        self._news.set()

    async def run(self) -> None:
        """Look at all hardware stops until cancelled; without a rule, wait for one."""
        looked_at = anyio.current_time()
        while True:
            self._news = anyio.Event()
            now = anyio.current_time()
            is_stalled = bool(self._watched) and now - looked_at > _STALL_S
            looked_at = now
            try:
                has_rules = self._look(now, is_stalled=is_stalled)
            except Exception:  # the others are looked at again
                log.exception("the hardware stops could not be looked at")
                has_rules = True
            with anyio.move_on_after(_POLL_S if has_rules else None):
                await self._news.wait()

    def _look(self, now: float, *, is_stalled: bool) -> bool:
        rules = {name: rule for name in self._robots.names if (rule := self._rule_of(name))}
        for name in self._watched.keys() - rules.keys():
            self._leave(name)
        for name, rule in rules.items():
            watched = self._watched.get(name)
            if watched is None or not self._is_so(watched, rule):
                self._leave(name)
                watched = _Watched(self._robots.registration(name), rule, now)
                self._watched[name] = watched
                self._runtime.tasks.start_soon(self._listen, watched)
            self._look_at(watched, now, is_stalled=is_stalled)
        return bool(rules)

    def _is_so(self, watched: _Watched, rule: HardwareStop) -> bool:
        """Return whether a hardware stop is still listened to where the rule and the registration say."""
        try:
            return watched.rule == rule and watched.place == self._robots.registration(
                watched.robot
            )
        except NotFound:
            return False

    def _leave(self, robot: str) -> None:
        watched = self._watched.pop(robot, None)
        if watched is not None and watched.signal is not None:
            watched.signal.close()

    def _look_at(self, watched: _Watched, now: float, *, is_stalled: bool) -> None:
        if watched.signal is not None and now - watched.looked_at >= _PROBLEM_S:
            watched.looked_at = now
            watched.problem = watched.signal.problem()
        why = watched.why(now)
        if watched.signal is not None and watched.signal.presses != watched.presses:
            watched.presses = watched.signal.presses
            self._act(
                watched, why or f"The hardware stop of {watched.robot} was pressed for a moment."
            )
        elif why and watched.counts(now):
            is_new = not watched.is_told or (not watched.knew and self._knows(watched.robot))
            if is_new and (watched.signal_says_pressed or not is_stalled):
                self._act(watched, why)
        if not why:
            watched.is_told, watched.was_clear = False, True
        if why != watched.shown:
            watched.shown = why
            self._changed(watched.robot)

    def _act(self, watched: _Watched, why: str) -> None:
        watched.is_told, watched.knew = True, self._knows(watched.robot)
        self._pressed(watched.robot, why)

    def _knows(self, robot: str) -> bool:
        """Return whether the engine of a robot has answered, so that what runs there is known."""
        engine = self._robots.link(robot)
        return engine is not None and engine.answer is not None

    async def _listen(self, watched: _Watched) -> None:
        while watched.signal is None and self._watched.get(watched.robot) is watched:
            try:
                signal = await self._robots.stop_signal(watched.robot, watched.rule, self.look)
                if self._watched.get(watched.robot) is not watched:
                    signal.close()
                    return
                watched.signal = signal
            except (RuntimeError, Refused) as error:  # without a link, a package, a domain
                watched.problem = str(error).rstrip(". ") or repr(error)
                self.look()
                await anyio.sleep(_AGAIN_S)
        self.look()
