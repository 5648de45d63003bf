"""The rotation keeps the newest backup of each of so many days, weeks and months."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.commands.backups.options import name_at, parse_retention, superfluous

NOW = datetime(2026, 11, 24, 12, tzinfo=UTC)


def paths(*ages: timedelta) -> list[Path]:
    return [Path("/b") / name_at(NOW - age) for age in ages]


def left(found: list[Path], rule: str) -> list[Path]:
    return sorted(set(found) - set(superfluous(found, parse_retention(rule), NOW)), reverse=True)


def test_a_year_of_nights_leaves_seventeen_at_most() -> None:
    nights = paths(*(timedelta(days=n) for n in range(365)))
    kept = left(nights, "7d,4w,6m")
    assert kept[:7] == nights[:7]
    assert 13 <= len(kept) <= 17
    months = {path.name[17:23] for path in kept}
    assert months == {"202606", "202607", "202608", "202609", "202610", "202611"}


def test_the_newest_backup_of_a_day_stays() -> None:
    hours = paths(*(timedelta(hours=n) for n in range(30)))
    assert left(hours, "2d") == [hours[0], hours[13]]


def test_nights_without_a_backup_use_up_none_of_those_that_stay() -> None:
    found = paths(timedelta(days=0), timedelta(days=40), timedelta(days=90))
    assert left(found, "3d") == found


@pytest.mark.parametrize(
    "name",
    [
        "monday.zip",
        "notes.txt",
        "action-assistant-2026.zip",
        "action-assistant-20260199-000000Z.zip",
    ],
)
def test_other_files_are_left_alone(name: str) -> None:
    old = [Path("/b") / name, *paths(timedelta(0), timedelta(hours=1))]
    assert superfluous(old, parse_retention("1d"), NOW) == old[2:]


def test_backups_of_a_clock_that_was_wrong_stay_and_none_goes_for_them() -> None:
    of_tomorrow = paths(*(timedelta(days=-n) for n in range(1, 9)))
    nights = paths(*(timedelta(days=n) for n in range(4)))
    assert superfluous([*of_tomorrow, *nights], parse_retention("3d"), NOW) == nights[3:]


def test_the_rule_all_keeps_every_backup() -> None:
    assert (
        superfluous(paths(*(timedelta(hours=n) for n in range(99))), parse_retention("all"), NOW)
        == []
    )


@pytest.mark.parametrize("rule", ["", "0d", "7", "7x", "d", "7d 4w", "-1d"])
def test_a_text_that_is_no_rule_is_refused(rule: str) -> None:
    with pytest.raises(ValueError):
        parse_retention(rule)


@given(
    st.lists(st.integers(0, 10_000_000), min_size=1, max_size=40, unique=True),
    st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(1, 9)),
)
def test_the_newest_always_stays_and_going_on_loses_nothing_more(
    ages: list[int], counts: tuple[int, int, int]
) -> None:
    rule = "{}d,{}w,{}m".format(*counts)
    found = paths(*(timedelta(seconds=each) for each in sorted(ages)))
    kept = left(found, rule)
    assert kept[0] == found[0]
    assert left(kept, rule) == kept
