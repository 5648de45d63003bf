"""Facts of a robot's profile are read and checked."""

import pytest

from action_assistant.umrf.facts import PINNED, SIMULATED, BadProfile, facts_of


def test_a_profile_that_says_nothing_is_the_pinned_engine() -> None:
    assert facts_of({}) == PINNED


def test_a_profile_changes_what_it_names_and_nothing_else() -> None:
    facts = facts_of({"commit": "5819055", "pauses_safely": True, "hazards": ["H3", "H5"]})
    assert facts.pauses_safely
    assert facts.hazards == frozenset({"H3", "H5"})
    assert (facts.stop_topic, facts.stop_timeout_ms) == (PINNED.stop_topic, PINNED.stop_timeout_ms)


def test_a_robot_synchronises_only_if_its_profile_says_so() -> None:
    assert not facts_of({"commit": "simulator"}).synchronises
    assert facts_of({"commit": "simulator", "synchronises": True}).synchronises
    assert SIMULATED.synchronises


def test_a_commit_that_nobody_measured_keeps_its_name() -> None:
    assert facts_of({"commit": "abcdef0"}).commit == "abcdef0"


@pytest.mark.parametrize(
    ("profile", "path"),
    [
        ({"pauses": True}, "/pauses"),
        ({"pauses_safely": "yes"}, "/pauses_safely"),
        ({"hazards": ["H99"]}, "/hazards"),
        ({"hazards": "H3"}, "/hazards"),
        ({"stop_timeout_ms": 0}, "/stop_timeout_ms"),
        ({"commit": 7}, "/commit"),
    ],
)
def test_an_impossible_fact_is_refused_with_its_place(
    profile: dict[str, object], path: str
) -> None:
    with pytest.raises(BadProfile) as refused:
        facts_of(profile)
    assert refused.value.path == path
