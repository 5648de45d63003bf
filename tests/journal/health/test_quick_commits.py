"""When commits count as quick: by the last hundred of them."""

from action_assistant.journal.health.quick_commits import QuickCommits


def after(*seconds: float) -> bool:
    """Whether commits are quick when these were the last."""
    commits = QuickCommits()
    for each in seconds:
        commits.took(each)
    return commits.are_quick


def test_of_the_first_twenty_nothing_is_known() -> None:
    assert not after(*[0.001] * 19)
    assert after(*[0.001] * 20)


def test_five_of_a_hundred_may_be_slow() -> None:
    assert after(*[0.001] * 95, *[0.03] * 5)
    assert not after(*[0.001] * 94, *[0.03] * 6)
    assert not after(*[0.001] * 15, *[0.03] * 6)


def test_one_that_is_far_too_slow_is_remembered_until_a_hundred_more_are_over() -> None:
    assert not after(*[0.001] * 50, 0.11, *[0.001] * 99)
    assert after(*[0.001] * 50, 0.11, *[0.001] * 100)


def test_a_disk_that_becomes_quick_is_trusted_again() -> None:
    assert not after(*[0.03] * 100, *[0.001] * 94)
    assert after(*[0.03] * 100, *[0.001] * 95)
