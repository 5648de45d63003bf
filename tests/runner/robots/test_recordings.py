"""Messages of engines are recorded unchanged, for a while."""

import gzip
from pathlib import Path

import anyio
import msgspec
import pytest

from action_assistant.errors import NotFound
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer, Feedback
from action_assistant.runner.robots.recordings import FeedbackLine, GetLine, Recordings
from runner.harness import at_once, run_in_virtual_time

HOUR = 3_600_000_000
DAY = 24 * HOUR


def answer(at: int, **texts: str) -> Answer:
    return Answer(asked_at=at, at=at, incarnation="life", graphs=(), texts=texts)


def kept(folder: Path, *said: Answer | Feedback, **limits: int) -> Recordings:
    """Recordings that have heard all of this from David, each some seconds after the other."""
    recordings = Recordings(folder, at_once, **limits)

    async def live() -> None:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(recordings.run)
            for each in said:
                match each:
                    case Answer():
                        recordings.record_answer("David", each)
                    case Feedback():
                        recordings.record_feedback("David", each)
                await anyio.sleep(5)
            tasks.cancel_scope.cancel()

    run_in_virtual_time(live)
    return recordings


def lines(folder: Path) -> list[GetLine | FeedbackLine]:
    decoder = msgspec.json.Decoder(GetLine | FeedbackLine)
    files = sorted(folder.glob("David/*"))
    return [decoder.decode(x) for f in files for x in gzip.decompress(f.read_bytes()).splitlines()]


def test_only_changed_graphs_of_answers_are_recorded(tmp_path: Path) -> None:
    kept(tmp_path, answer(1, a="1"), answer(2, a="1"), answer(3, a="1", b="2"), answer(4, b="2"))
    assert lines(tmp_path) == [
        GetLine(1, 1, "life", {"a": "1"}),
        GetLine(3, 3, "life", {"b": "2"}),
        GetLine(4, 4, "life", {}, ("a",)),
    ]


def test_feedback_is_kept_whole(tmp_path: Path) -> None:
    shown = Snapshot(at=7, graph="g", state="RUNNING", nodes={"A_0": "RUNNING"}, source="feedback")
    kept(tmp_path, Feedback(actor="David", snapshots=(shown,)))
    assert lines(tmp_path) == [FeedbackLine(7, "David", (shown,))]


@pytest.mark.parametrize("limits", [{"kept_days": 2}, {"kept_bytes": 250}])
def test_the_oldest_go_first(tmp_path: Path, limits: dict[str, int]) -> None:
    kept(tmp_path, *(answer(i * DAY, g=f"{i}") for i in range(6)), **limits)
    left = [line.at // DAY for line in lines(tmp_path)]
    assert left == [4, 5]


def test_only_recordings_are_given_out(tmp_path: Path) -> None:
    recordings = kept(tmp_path, answer(1, a="1"))
    (tmp_path / "secret").write_text("x")

    async def ask() -> None:
        (one,) = await recordings.listed("David")
        assert gzip.decompress(await recordings.file("David", one.name))
        with pytest.raises(NotFound):
            await recordings.file("David", "../secret")

    run_in_virtual_time(ask)
