"""A token bucket gives out what it holds, and its debt lasts until it has refilled."""

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.kit.token_bucket import TokenBucket

AMOUNTS = st.lists(st.tuples(st.floats(0, 10), st.floats(0, 5)), min_size=1, max_size=50)


def test_tokens_that_were_spent_come_back_at_the_rate() -> None:
    now = 0.0
    bucket = TokenBucket(10, 2, lambda: now)
    bucket.spend(14)
    assert (bucket.is_overdrawn, bucket.debt()) == (True, 2)
    now = 1.0
    assert bucket.debt() == 1
    now = 60.0
    bucket.spend(10)
    assert (bucket.is_overdrawn, bucket.debt()) == (False, 0)


@given(AMOUNTS)
def test_a_client_that_waits_for_its_debt_spends_no_more_than_burst_and_rate(
    amounts: list[tuple[float, float]],
) -> None:
    now = spent = 0.0
    bucket = TokenBucket(5, 2, lambda: now)
    for tokens, pause in amounts:
        now += max(pause, bucket.debt())
        assert spent <= 5 + 2 * now + 1e-6
        bucket.spend(tokens)
        spent += tokens
