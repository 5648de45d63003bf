"""The hardware stop of a robot, as a topic reports it. Information, and no safety function: the stop itself
works without it, and the runner acts on what it hears. Pure."""

import re
from math import inf, isfinite
from typing import Final, Literal, TypeAlias

import msgspec

SignalKind: TypeAlias = Literal["bool", "diagnostics"]
#: The ROS 2 types of the messages.
TYPES: Final[dict[SignalKind, str]] = {
    "bool": "std_msgs/msg/Bool",
    "diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
TOPIC: Final = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_LONGEST_AGE_S: Final = 3600.0


class HardwareStop(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Names the topic on which a robot reports its hardware stop. `age_s`: seconds after which the newest message is too old.
    Of `bool`, `pressed` is the value that means pressed; of `diagnostics`, the status with the name `status`
    at this `level` or above means pressed."""

    topic: str
    kind: SignalKind = "bool"
    age_s: float = 1.0
    pressed: bool = True
    status: str = ""
    level: int = 2

    @property
    def fault(self) -> str:
        """The reason why this cannot be listened to, as a sentence; "" if it can."""
        if not TOPIC.fullmatch(self.topic) or len(self.topic) > 200:
            return "This is no name of a ROS 2 topic."
        if not isfinite(self.age_s) or not 0.1 <= self.age_s <= _LONGEST_AGE_S:
            return f"The age of a message is 0.1 to {_LONGEST_AGE_S:.0f} s."
        if self.kind == "diagnostics" and not self.status:
            return "Name the status: a topic of diagnostics has those of many programs."
        return ""

    @property
    def full_topic(self) -> str:
        """The topic with its slash."""
        return self.topic if self.topic.startswith("/") else f"/{self.topic}"

    def words(self) -> str:
        """Return in words what means pressed."""
        if self.kind == "bool":
            what = str(self.pressed).lower()
        else:
            what = f"{self.status} at level {self.level} or above"
        return f"{what} on {self.full_topic}, {self.age_s:g} s old at most"


class StopSignal:
    """The newest message of a hardware stop, as the thread that receives messages writes it. `pressed`:
    None before the first one; `at`: when it came, in monotonic seconds; `presses`: how often the stop
    was pressed so far, so that a short press is not missed."""

    def __init__(self) -> None:
        self.pressed: bool | None = None
        self.at = -inf
        self.presses = 0

    def hear(self, *, pressed: bool, at: float) -> bool:
        """Note a message; return whether it says another thing than the one before it."""
        is_news = pressed is not self.pressed
        self.presses += is_news and pressed
        self.at, self.pressed = at, pressed
        return is_news

    def close(self) -> None:
        """Receive no more messages of this topic."""

    def problem(self) -> str:
        """Return what is wrong with who publishes, as part of a sentence; "" if nothing is."""
        return ""
