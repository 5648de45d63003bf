"""Edits of one person in one go are listed once; edits of others do not split them."""

from datetime import UTC, datetime, timedelta

from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.editor.history.graph_history import EditSession, Step, edit_sessions
from support.doses import examples

_MORNING = datetime(2026, 11, 23, 8, tzinfo=UTC)


def _edit(who: str, minute: float, seq: int) -> Step:
    return Step("edited", who, _MORNING + timedelta(minutes=minute), seq)


def _told(found: list[EditSession]) -> list[tuple[str, str, int | None, int]]:
    return [(each.kind, each.author, each.from_seq, each.seq) for each in found]


def test_two_who_edit_at_once_have_a_sitting_each() -> None:
    found = edit_sessions(_edit("ada" if n % 2 else "mari", n / 10, n + 2) for n in range(10))
    assert _told(found) == [("edited", "mari", 2, 10), ("edited", "ada", 3, 11)]


def test_after_a_break_another_sitting_begins() -> None:
    found = edit_sessions([_edit("ada", 0, 2), _edit("ada", 4.9, 3), _edit("ada", 10, 4)])
    assert _told(found) == [("edited", "ada", 2, 3), ("edited", "ada", 4, 4)]


def test_a_version_ends_the_sittings_of_everybody() -> None:
    version = Step("published", "mari", _MORNING, None, told=7)
    found = edit_sessions([_edit("ada", 0, 2), version, _edit("ada", 1, 3)])
    assert _told(found) == [
        ("edited", "ada", 2, 2),
        ("published", "mari", None, 2),
        ("edited", "ada", 3, 3),
    ]
    assert found[1].told == 7


def test_a_graph_that_was_read_from_a_file_was_imported() -> None:
    created = Step("created", "ada", _MORNING, 1)
    found = edit_sessions([created, created._replace(kind="imported", seq=None)])
    assert _told(found) == [("imported", "ada", None, 1)]


def test_a_large_file_that_was_stored_before_its_graph_is_one_entry_too() -> None:
    created = Step("created", "ada", _MORNING, 1)
    imported = created._replace(kind="imported", seq=None)
    found = edit_sessions([imported, created, _edit("ada", 9, 2)])
    assert _told(found) == [("imported", "ada", None, 1), ("edited", "ada", 2, 2)]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["ada", "mari", "hella"]),
            st.sampled_from(["edited", "edited", "edited", "published", "restored"]),
            st.floats(0, 8),
        ),
        max_size=40,
    )
)
@settings(max_examples=examples(200))
def test_each_edit_is_in_exactly_one_sitting(doings: list[tuple[str, str, float]]) -> None:
    steps: list[Step] = []
    minute, seq = 0.0, 1
    for who, kind, gap in doings:
        minute += gap
        seq += kind != "published"
        at = _MORNING + timedelta(minutes=minute)
        steps.append(Step(kind, who, at, None if kind == "published" else seq))  # type: ignore[arg-type]
    found = edit_sessions(steps)
    assert [s.seq for s in found] == sorted(s.seq for s in found)
    for step in steps:
        if step.seq is None:
            continue
        holding = [
            session
            for session in found
            if session.author == step.author
            and session.from_seq is not None
            and session.from_seq <= step.seq <= session.seq
        ]
        assert len(holding) == 1
        assert holding[0].at <= step.at <= holding[0].until
