"""The health of a robot, as topics report it: its battery, and levels of its diagnostics. Information for
whoever starts something there, and no safety function. Pure."""

import re
from math import isfinite
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.links.hardware_stop import TOPIC, TYPES
from action_assistant.safe_text import one_line

HealthKind: TypeAlias = Literal["battery", "diagnostics"]
#: `poor`: beyond the threshold.
HealthState: TypeAlias = Literal["fine", "poor", "unknown"]
#: What follows for a start.
Consequence: TypeAlias = Literal["warn", "block"]
#: The ROS 2 types of the messages.
HEALTH_TYPES: Final[dict[HealthKind, str]] = {
    "battery": "sensor_msgs/msg/BatteryState",
    "diagnostics": TYPES["diagnostics"],
}
MOST_CHECKS: Final = 20  # of one robot
_LONGEST_AGE_S: Final = 3600.0
_LONGEST_TEXT: Final = 200
_LEVELS: Final = ("OK", "WARN", "ERROR")
_STALE: Final = 3
_SPACES: Final = re.compile(r"\s+")


class HealthCheck(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Names something of a robot's health, and what follows for a start there. Of `battery`, a share of
    charge below `below` percent is poor; of `diagnostics`, the status with the name `status` at this
    `level` or above. `age_s`: seconds after which the newest message says nothing any more; `poor`,
    `unknown`: what follows where it is that."""

    topic: str
    kind: HealthKind = "battery"
    below: float = 30.0
    status: str = ""
    level: int = 2
    age_s: float = 30.0
    poor: Consequence = "warn"
    unknown: Consequence = "warn"

    @property
    def fault(self) -> str:
        """The reason why this cannot be checked, as a sentence; "" if it can."""
        if not TOPIC.fullmatch(self.topic) or len(self.topic) > _LONGEST_TEXT:
            return "This is no name of a ROS 2 topic."
        if not isfinite(self.age_s) or not 0.1 <= self.age_s <= _LONGEST_AGE_S:
            return f"The age of a message is 0.1 to {_LONGEST_AGE_S:.0f} s."
        if self.kind == "battery" and not 0 < self.below <= 100:
            return "The threshold of a battery is more than 0 %, and 100 % at most."
        if self.kind == "diagnostics" and not self.status:
            return "Name the status: a topic of diagnostics has those of many programs."
        return ""

    @property
    def full_topic(self) -> str:
        """The topic with its slash."""
        return self.topic if self.topic.startswith("/") else f"/{self.topic}"

    @property
    def source(self) -> tuple[HealthKind, str, str]:
        """The part that says where to listen."""
        return self.kind, self.full_topic, self.status if self.kind == "diagnostics" else ""

    def words(self) -> str:
        """Return in words what follows when."""
        if self.kind == "battery":
            when = f"battery below {self.below:g} %"
        else:
            when = f"{one_line(self.status)} at {_level_word(self.level)} or above"
        says = {"warn": "warns", "block": "blocks a start"}
        return (
            f"{when} on {self.full_topic} {says[self.poor]}; unknown (older than {self.age_s:g} s) "
            f"{says[self.unknown]}"
        )


class Reading(msgspec.Struct, frozen=True):
    """The content of one message: the percent of a battery, or a level. `fault`: why it has no value, as
    part of a sentence, "" if it has; `said`: the words of the reporter."""

    value: float | None
    fault: str = ""
    said: str = ""


class HealthNow(msgspec.Struct, frozen=True, kw_only=True):
    """A report of a robot's health at one moment. `value`: percent of a battery, or a level, None where it
    is unknown; `age_s`: seconds since the newest message came, None before the first one; `words`: all of it
    in words, without the age."""

    check: HealthCheck
    state: HealthState
    words: str
    value: float | None = None
    age_s: float | None = None

    @property
    def consequence(self) -> Consequence | None:
        """The effect on a start; None for no effect."""
        match self.state:
            case "fine":
                return None
            case "poor":
                return self.check.poor
            case "unknown":
                return self.check.unknown

    def sentence(self) -> str:
        """Return all of it as a sentence."""
        topic = self.check.full_topic
        if self.age_s is None:
            return f"{self.words} ({topic})."
        return f"{self.words} ({topic}, {_age_words(self.age_s)} ago)."


class HealthSignal:
    """The newest message about a robot's health, as the thread that receives messages writes it. `newest`:
    None before the first one, else with the time at which it came, in monotonic seconds."""

    def __init__(self) -> None:
        self.newest: tuple[Reading, float] | None = None

    def close(self) -> None:
        """Receive no more messages of this topic."""

    def problem(self) -> str:
        """Return what is wrong with who publishes, as part of a sentence; "" if nothing is."""
        return ""


def battery_reading(share: float) -> Reading:
    """Return what a battery reports as its share of charge, which is 0 to 1."""
    if not isfinite(share) or not 0 <= share <= 1:
        return Reading(None, f"it reports {share:g}, which is no share of charge from 0 to 1")
    return Reading(round(100 * share, 2))


def status_reading(level: int, message: str) -> Reading:
    """Return what a status of diagnostics reports. The text is bounded, and in one line."""
    said = one_line(_SPACES.sub(" ", message[: 4 * _LONGEST_TEXT]).strip()[:_LONGEST_TEXT])
    if level == _STALE:
        return Reading(None, "it is reported as stale", said)
    if not 0 <= level < len(_LEVELS):
        return Reading(None, f"it has the level {level}, which is none")
    return Reading(float(level), said=said)


def health_now(
    robot: str,
    check: HealthCheck,
    newest: tuple[Reading, float] | None,
    problem: str,
    now: float,
) -> HealthNow:
    """Return the health of a robot now. `newest`: as `HealthSignal` has it; `problem`: what is wrong with
    who publishes, "" for nothing; `now`: monotonic seconds. All that shows health and all that decides
    about a start is made of this."""
    what = f"The battery of {robot}" if check.kind == "battery" else f"“{check.status}” of {robot}"
    age_s = None if newest is None else max(0.0, now - newest[1])

    def unknown(why: str) -> HealthNow:
        words = f"{what} is unknown: {why}"
        return HealthNow(check=check, state="unknown", words=words, age_s=age_s)

    if problem:
        return unknown(problem)
    if newest is None or age_s is None:
        return unknown("no message about it has come")
    if age_s > check.age_s:
        return unknown(f"the newest message is older than {check.age_s:g} s")
    reading = newest[0]
    said = f", “{reading.said}”" if reading.said else ""
    if reading.value is None:
        return unknown(reading.fault + said)
    if check.kind == "battery":
        is_poor = reading.value < check.below
        words = f"{what} is at {reading.value:g} %"
        words += f", below {check.below:g} %" if is_poor else ""
    else:
        is_poor = reading.value >= check.level
        words = f"{what} is at {_level_word(int(reading.value))}{said}"
    state: HealthState = "poor" if is_poor else "fine"
    return HealthNow(check=check, state=state, words=words, value=reading.value, age_s=age_s)


def _level_word(level: int) -> str:
    return _LEVELS[level] if 0 <= level < len(_LEVELS) else str(level)


def _age_words(age_s: float) -> str:
    if age_s < 10:
        return f"{age_s:.1f} s"
    return f"{age_s:.0f} s" if age_s < 120 else f"{age_s / 60:.0f} min"
