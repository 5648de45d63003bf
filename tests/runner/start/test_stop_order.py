"""The memory of Stops and closed queues is bounded, and no start leaves because an entry was dropped."""

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.start.idempotency import StopOrder
from runner.harness import ANN, BEN

NAMES = st.sampled_from(["David", "Carol", "g1", "g2", "repeat"])
STEPS = st.lists(st.tuples(st.sampled_from(["stop", "refuse"]), NAMES), max_size=30)


@given(STEPS, st.integers(1, 4), NAMES, st.integers(0, 30))
def test_what_a_bounded_memory_has_merged_holds_back_at_least_as_much(
    steps: list[tuple[str, str]], most: int, name: str, count: int
) -> None:
    whole, bounded = StopOrder(), StopOrder(most)
    for kind, what in steps:
        for each in (whole, bounded):
            if kind == "stop":
                each.note(what, ANN)
            else:
                each.refuse(what, f"{what} was closed.")
    assert bounded.count == whole.count
    assert bool(bounded.since(count, name)) >= bool(whole.since(count, name))
    assert bool(bounded.why_refused(count, name)) >= bool(whole.why_refused(count, name))
    assert max(len(bounded._newest), len(bounded._refused)) <= most
    # A start that is asked for now is held back by nothing of it.
    assert not bounded.since(bounded.count, name)
    assert not bounded.why_refused(bounded.count, name)


def test_closings_without_number_take_no_room_and_a_stop_of_everything_stays_known() -> None:
    order = StopOrder()
    order.note("", ANN, "s1")
    for number in range(10_000):
        order.refuse(f"repeat {number}", "It was closed.")
    assert order.since(0, "David") == (ANN, "s1")
    assert len(order._refused) <= 2000
    order.note("David", BEN)
    assert order.since(0, "David") == (BEN, "")
