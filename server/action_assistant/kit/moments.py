"""Times between microseconds UTC, as the logs have them, and datetimes, as clients send and get them."""

from datetime import UTC, datetime, timedelta
from typing import Final

from action_assistant.errors import BadInput

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
#: The second day of the year 1, and the last but one of 9999: other zones have these days, too.
_FIRST_US: Final = -62_135_510_400_000_000
_LAST_US: Final = 253_402_128_000_000_000
_LATEST: Final = datetime(3000, 1, 1, tzinfo=UTC)


def moment(us: int) -> datetime:
    """Return a time in microseconds UTC as a datetime in UTC. A time that no calendar holds becomes
    the first or last one: what is stored can be shown, whatever it says."""
    return _EPOCH + timedelta(microseconds=min(max(us, _FIRST_US), _LAST_US))


def sent_us(sent: datetime, path: str) -> int:
    """Return a date that a client sent, in microseconds UTC. `path`: the path of its field in the
    body. Raise BadInput for one without a time zone, or before 1970 or after 2999."""
    if sent.tzinfo is None:
        raise BadInput("A time names its time zone.", where={"path": path})
    if not 0 <= (sent - _EPOCH).total_seconds() < (_LATEST - _EPOCH).total_seconds():
        raise BadInput("A time lies between the years 1970 and 3000.", where={"path": path})
    return (sent - _EPOCH) // timedelta(microseconds=1)
