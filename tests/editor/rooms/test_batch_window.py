"""Edits made at the same time go together, and windows follow the load of the loop."""

import asyncio
import time

import pytest

from action_assistant.editor.rooms.batch import BatchWindow, TurnEnd


async def test_edits_that_come_together_are_handled_in_one_window() -> None:
    window, done, both = BatchWindow(), list[str](), asyncio.Event()
    window.when_open(lambda: done.append("a"))
    await asyncio.sleep(0)
    window.when_open(both.set)
    assert done == []
    await asyncio.wait_for(both.wait(), 5)
    assert done == ["a"]


async def test_windows_are_longer_the_busier_the_loop_is(monkeypatch: pytest.MonkeyPatch) -> None:
    now = worked = 100.0
    loop = asyncio.get_running_loop()
    monkeypatch.setattr(loop, "time", lambda: now)
    monkeypatch.setattr(time, "thread_time", lambda: worked)
    window = BatchWindow(0.01)
    lengths: list[float] = []
    for busy in (0.0, 0.1, 0.35, 0.7, 1.0, 0.0):
        now += 1.0
        worked += busy
        window._open()
        lengths.append(window._next - now)
    assert lengths == pytest.approx([0.001, 0.001, 0.0025, 0.01, 0.01, 0.001])


async def test_a_room_that_fails_keeps_no_other_from_its_turn(
    caplog: pytest.LogCaptureFixture,
) -> None:
    end, done = TurnEnd(), list[str]()

    def fails() -> None:
        raise RuntimeError("for a test")

    end.do(lambda: done.append("a"))
    end.do(fails)
    end.do(lambda: (done.append("b"), end.do(lambda: done.append("c")))[0])
    assert done == []
    await asyncio.sleep(0)
    assert done == ["a", "b"]
    await asyncio.sleep(0)
    assert done == ["a", "b", "c"]
    assert "for a test" in caplog.text
