"""The assumed opening time of a document is never too small until the time is measured."""

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.editor.crdt.opening_time import OpeningTime

STEP = 75e-9  # seconds, as the module has it


@given(
    st.lists(st.tuples(st.integers(0, 3_000), st.integers(0, 200), st.floats(0, 0.2)), max_size=30)
)
def test_without_doubt_no_more_is_added_than_may_be(history: list[tuple[int, int, float]]) -> None:
    """Structs come, some before a measurement and some while it goes on; each takes 10 bytes of the
    document."""
    opening, structs, measured, seconds = OpeningTime(), 0, 0, 0.0
    for come, meanwhile, took in history:
        if opening.is_doubtful_with(0):
            opening.opened(took, 10 * structs)
            measured, seconds = structs, took
        opening.took(come)
        structs += come
        if not opening.is_doubtful_with(0):
            limit = min(2.0, 0.25 + 0.2 * 10 * measured / (1 << 20))
            most = max(0.1 + seconds, (limit - seconds) / 2)
            assert (structs**2 - measured**2) / 4 * STEP <= most * (1 + 1e-9)
        then = opening.came
        opening.took(meanwhile)
        opening.opened(took, 10 * structs, then)
        measured, seconds = structs, took
        structs += meanwhile


def test_a_measurement_is_due_long_before_the_opening_time_is_in_doubt() -> None:
    opening = OpeningTime()
    while not opening.is_due:
        opening.took(10)
    assert not opening.is_doubtful_with(5_000)
    opening.opened(0.001, 50_000, opening.came)
    assert not opening.is_due


def test_a_value_that_is_written_again_and_again_makes_no_doubt() -> None:
    """The document stays as small as it was, whatever was added to it."""
    opening = OpeningTime()
    asked = 0
    for _ in range(100_000):
        opening.took(1)
        if opening.is_due:
            asked += 1
            opening.opened(0.001, 400, opening.came)
        assert not opening.is_doubtful_with(60)
    assert asked < 100


def test_updates_that_came_during_an_older_measurement_stay_counted() -> None:
    """A newer one was faster: the older one tells nothing of what came after it."""
    opening = OpeningTime()
    opening.took(2_000)
    began = opening.came
    opening.took(10)
    opening.opened(0.001, 400)
    opening.took(3_000)
    assert opening.is_doubtful_with(0)
    opening.opened(0.001, 400, began)
    assert opening.is_doubtful_with(0)
