"""A conducted run of whose events some cannot be read after a restart: its pieces are not left alone."""

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.runs.events import (
    Observed,
    PieceBegan,
    PieceSeen,
    Published,
    Requested,
)
from runner.execution.test_conductor import Lab, alarms, refused
from runner.harness import BEN, MemoryJournal, ended, order, sequence, until, virtual


def damage(journal: MemoryJournal, run: str, kind: str) -> None:
    """Make the first stored event of this kind in a run unreadable."""
    events = journal.streams[f"run/{run}"]
    number = next(n for n, each in enumerate(events) if each.kind == kind)
    events[number] = msgspec.structs.replace(events[number], body=b"{")


@pytest.mark.parametrize("kind", [Published.kind, PieceBegan.kind, PieceSeen.kind])
@virtual
async def test_the_pieces_of_a_run_that_cannot_be_read_are_followed_and_stopped(kind: str) -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, run, kind)
    async with lab.runner() as control:
        found = control.open[run].run
        assert found.state == "unknown"
        assert len(alarms(found, "led_unread")) == 1
        piece = control.open[f"{run}.1"]
        await anyio.sleep(5)
        assert piece.run.state == "running"
        assert control.open[run].run.state == "unknown"
        assert control.open[run].run.actions["Work_0"].state == "RUNNING"
        assert "is taken by run 1" in await refused(control, order(sequence("o"), engine="Carol"))
        with pytest.raises(Conflict):
            await control.confirm_rest(run, RestRequest("I stand beside it."), BEN)
        await control.stop(run, BEN)
        assert await lab.david.moving("task--Work_0")
        assert control.open[run].run.end is None
        await until(lambda: run not in control.open)
        assert not await lab.david.moving("task--Work_0")
        last = next(each for _, each in reversed(lab.harness.shown) if each.id == run)
        assert last.state == "stopped"
        assert last.proof_at is not None
        assert (await control.find(f"{run}.1")).proof_at is not None
        assert len(lab.david.starts) == 1
        assert lab.carol.starts == []


@virtual
async def test_a_piece_that_cannot_be_read_is_never_sent_again() -> None:
    lab = Lab({"*": [{"after_s": 5, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, f"{run}.1", Observed.kind)
    async with lab.runner() as control:
        await anyio.sleep(20)
        found = control.open[run].run
        assert found.state == "unknown"
        assert found.actions["Work_0"].state == "FINISHED"
        assert len(lab.david.starts) == 1
        assert lab.carol.starts == []
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@virtual
async def test_the_pieces_of_a_run_whose_start_cannot_be_read_are_runs_of_their_own() -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, run, Requested.kind)
    async with lab.runner() as control:
        piece = f"{run}.1"
        assert piece in control.shown
        assert len(alarms(control.open[piece].run, "led_unread")) == 1
        assert control.stop_all(BEN).runs == [piece]
        assert await ended(control, piece) == "stopped"
        assert not await lab.david.moving("task--Work_0")
