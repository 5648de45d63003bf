"""Random ids: fit for every place where somebody writes them."""

from action_assistant.random_ids import random_id


def test_an_id_is_letters_and_digits_so_no_shell_takes_it_for_an_option() -> None:
    ids = {random_id() for _ in range(10_000)}
    assert len(ids) == 10_000
    assert all(len(each) == 12 and each.isascii() and each.isalnum() for each in ids)
