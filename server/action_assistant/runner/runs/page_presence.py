"""The rule of a robot that the page of whoever is responsible for a run stays visible. Pure."""

from typing import Final

import msgspec

#: Pages are asked about once a second.
MIN_PRESENCE_S: Final = 3.0
_LONGEST_PRESENCE_S: Final = 3600.0


class PagePresence(msgspec.Struct, frozen=True, kw_only=True):
    """The rule that the page of whoever is responsible for a run stays visible. Seconds without an
    answer of one: after `wait_s` a led run begins nothing further, after `stop_s` each run is
    stopped."""

    wait_s: float
    stop_s: float

    @property
    def fault(self) -> str:
        """The reason why this cannot be a rule, as a sentence; "" if it can."""
        if not MIN_PRESENCE_S <= self.wait_s <= self.stop_s <= _LONGEST_PRESENCE_S:
            return (
                f"A page counts as missing after {MIN_PRESENCE_S:g} s or later; Stop follows then or "
                f"later, after {_LONGEST_PRESENCE_S:g} s at most."
            )
        return ""

    def words(self, robot: str, *, is_led: bool) -> str:
        """Return the sentences for whoever starts a run on a robot."""
        if is_led:
            what = (
                f"after {self.wait_s:g} s nothing further begins, and after {self.stop_s:g} s the run "
                "is stopped."
            )
        else:
            what = (
                f"after {self.stop_s:g} s the run is stopped. It cannot be made to wait before that: "
                "the engine has all of it."
            )
        return (
            f"{robot} asks for a visible page of whoever starts there or holds its baton. Without "
            f"one {what} This is no enabling device."
        )
