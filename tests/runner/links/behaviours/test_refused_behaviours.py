"""Starts that are refused, and names that lead nowhere: what is no behaviour is never run."""

import os
from pathlib import Path

import httpx
import pytest

from runner.harness import order
from runner.links.behaviours.driven import QUICK, result, start
from runner.links.behaviours.written import (
    OK,
    WAITS,
    chain,
    write,
)
from runner.process import RunnerProcess, body, over

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")


def test_a_link_is_refused_with_the_reason_before_anything_is_started(
    client: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    write(tmp_path / "elsewhere", secret=OK)
    (folder / "open_gripper.py").symlink_to(tmp_path / "elsewhere" / "secret.py")
    before = client.get("/api/runs").json()
    asked = order(chain("OpenGripper"), script=QUICK, behaviours=True)
    answer = client.post("/api/runs", content=body(asked))
    assert answer.status_code == 409
    assert answer.json()["detail"].startswith(
        "The behaviour open_gripper.py cannot be read: it is a link, and no link is followed."
    )
    assert answer.json()["where"] == {"path": "/behaviours"}
    assert client.get("/api/runs").json() == before


def test_the_behaviours_that_there_are_are_listed_with_what_cannot_be_run(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, open_gripper=OK, Odd=OK, notes=OK)
    (folder / "notes.txt").write_text("no behaviour")
    (folder / "held.py").mkdir()
    listed = client.get("/api/reach").json()["behaviours"]
    assert listed["names"] == ["notes", "open_gripper"]
    assert listed["refused"] == {
        "held": "The behaviour held.py cannot be read: it is no regular file."
    }


def test_a_folder_that_has_gone_meanwhile_refuses_the_start(
    client: httpx.Client, folder: Path
) -> None:
    folder.rename(folder.with_name("away"))
    asked = order(chain("Waits"), script=QUICK, behaviours=True)
    answer = client.post("/api/runs", content=body(asked))
    folder.with_name("away").rename(folder)
    assert answer.status_code == 409
    assert "folder of behaviours cannot be read" in answer.json()["detail"]


def test_a_runner_without_a_folder_has_none_and_says_so(process: RunnerProcess) -> None:
    with process.client() as client:
        assert client.get("/api/reach").json()["behaviours"] is None
        asked = order(chain("Waits"), script=QUICK, behaviours=True)
        answer = client.post("/api/runs", content=body(asked))
        assert answer.status_code == 409
        assert "has no behaviours" in answer.json()["detail"]


def test_names_from_graphs_lead_to_no_other_file(
    client: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    write(tmp_path, outside="raise SystemExit('was run')")
    write(folder, waits=WAITS)
    names = ["../outside", "..", str(tmp_path / "outside"), "waits.py", "waits\N{ZERO WIDTH SPACE}"]
    done = over(client, start(client, chain(*names)))
    assert done["state"] == "finished"
    assert {result(done, f"{name}_0") for name in names} == {"true"}  # by the script
