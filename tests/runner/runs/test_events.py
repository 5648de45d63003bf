"""Bodies of events, as a sound database gives them out and as a damaged one may."""

from typing import Any

import msgspec
import pytest

from action_assistant.runner.runs.events import decode


@pytest.mark.parametrize("body", [b"{", b"\xff", 5, 1.5, None])
def test_a_value_that_is_no_body_raises_a_decode_error(body: Any) -> None:
    with pytest.raises(msgspec.DecodeError):
        decode("run.observed.v1", body)
