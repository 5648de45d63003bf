"""Events that took effect before the log had them are stored later, each by itself."""

import pytest

from action_assistant.editor.people.late_records import LateRecords


async def test_an_event_that_the_log_never_takes_holds_up_none_after_it(
    caplog: pytest.LogCaptureFixture,
) -> None:
    late, stored = LateRecords("the end of persons"), list[str]()

    async def refused() -> None:
        raise KeyError("ada")

    async def taken() -> None:
        stored.append("ben")

    await late.add(refused)
    await late.add(taken)
    assert stored == ["ben"]
    assert caplog.text.count("the log cannot have one of the end of persons") == 1
    await late.aclose()
