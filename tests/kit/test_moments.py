"""Times of clients and of the log: none of them can keep what is stored from being shown."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import BadInput
from action_assistant.kit.moments import moment, sent_us


@given(st.integers())
def test_each_stored_time_is_shown_in_each_zone(us: int) -> None:
    shown = moment(us)
    assert shown.astimezone().isoformat()
    assert abs(us) > 10**16 or shown.timestamp() * 1e6 == pytest.approx(us, abs=200)


@given(st.datetimes(timezones=st.just(UTC)))
def test_a_sent_time_is_taken_exactly_or_refused(sent: datetime) -> None:
    if 1971 <= sent.year < 2999:
        assert moment(sent_us(sent, "/until")) == sent
    elif not 1969 <= sent.year <= 3000:
        with pytest.raises(BadInput):
            sent_us(sent, "/until")


def test_a_time_without_a_zone_is_refused_with_its_place() -> None:
    with pytest.raises(BadInput, match="names its time zone") as refused:
        sent_us(datetime.fromisoformat("2026-11-28"), "/until")
    assert refused.value.where == {"path": "/until"}
