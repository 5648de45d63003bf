"""The measure of growth tells linear work from quadratic work."""

from collections.abc import Callable

import pytest

from support.growth import grows_with_its_size


def test_linear_work_passes() -> None:
    def work(size: int) -> Callable[[], object]:
        return lambda: sum(range(size * 100))

    grows_with_its_size(work, 20_000)


def test_the_square_is_refused_each_time_it_is_tried() -> None:
    def work(size: int) -> Callable[[], object]:
        return lambda: sum(range(size * size))

    with pytest.raises(AssertionError, match="a sixteenth of it"):
        grows_with_its_size(work, 3_200)
