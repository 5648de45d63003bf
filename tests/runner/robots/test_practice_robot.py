"""The robot with which people practise needs a domain of its own."""

import pytest

from action_assistant.errors import Unavailable
from action_assistant.runner.robots.practice_robot import registration_beside


def test_a_practice_robot_without_a_free_domain_is_refused_with_the_reason() -> None:
    assert registration_beside({101, 99}).domain == 100
    with pytest.raises(Unavailable, match="All domains from 1 to 101 have robots"):
        registration_beside(range(102))
