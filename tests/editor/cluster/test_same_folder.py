"""Editors find out in time whether they have one data folder, and nothing else keeps one out."""

import asyncio
import json
import os
import shutil
import signal
from pathlib import Path
from typing import Any

import asyncpg  # type: ignore[import-untyped]
import httpx
import pytest

from action_assistant.journal.postgres import SLOT_LOCKS
from editor.cluster.several import OneOfSeveral, several
from editor.cluster.test_several_editors import asked
from journal.servers import Server
from support.waiting import until, wait_until

_NOW = "(extract(epoch FROM clock_timestamp()) * 1000000)::bigint"


@pytest.mark.parametrize("is_copied", [False, True])
def test_an_editor_with_another_folder_that_came_in_while_one_was_frozen_ends(
    tmp_path: Path, postgres: Server, is_copied: bool
) -> None:
    with several(tmp_path, postgres.new_database(), 1) as (one,):
        stranger = OneOfSeveral(tmp_path / "other" / "data", one.database, 9)
        if is_copied:
            shutil.copytree(one.data, stranger.data)
        else:
            stranger.data.mkdir(parents=True)
        one.process.send_signal(signal.SIGSTOP)
        try:
            stranger.start()
        finally:
            one.process.send_signal(signal.SIGCONT)
        try:
            assert stranger.process.wait(120) == 2
        finally:
            stranger.kill()
        said = stranger.log.read_text().strip().splitlines()[-1]
        assert f"does not find {stranger.data}/" in said
        assert "All editors of one database need the same data folder" in said
        two = OneOfSeveral(one.data, one.database, 2)
        two.start()
        two.kill()
        assert asked(one, "GET", "/api/graphs")
        assert one.process.poll() is None


def test_an_editor_whose_file_was_removed_puts_it_there_again(
    tmp_path: Path, postgres: Server
) -> None:
    with several(tmp_path, postgres.new_database(), 1) as (one,):
        (ours,) = one.data.glob(".probe-editor-*")
        os.utime(ours, (0, 0))  # long ago, so the next one that starts removes it
        two = OneOfSeveral(one.data, one.database, 2)
        two.start()
        try:
            until("the file is missing", lambda: ours.exists() and ours.stat().st_mtime > 0)
            assert len([*one.data.glob(".probe-editor-*")]) == 2
        finally:
            two.kill()


def test_an_editor_that_is_refused_begins_no_epoch(tmp_path: Path, postgres: Server) -> None:
    with several(tmp_path, postgres.new_database(), 1) as (one,):
        count = "SELECT count(*) FROM event WHERE stream = 'epochs'"
        name = one.database.rpartition("/")[2]
        before = postgres.ask(count, name)
        stranger = OneOfSeveral(tmp_path / "copy" / "data", one.database, 9)
        shutil.copytree(one.data, stranger.data)
        # A copy from before a restore: the log has lost the event of its mark.
        mark = json.loads((stranger.data / "editor.mark").read_text())
        mark["chain"] = "00" * 32
        (stranger.data / "editor.mark").write_text(json.dumps(mark))
        stranger.begin()
        assert stranger.process.wait(60) == 2
        assert "does not find" in stranger.log.read_text()
        assert postgres.ask(count, name) == before


async def test_a_file_that_cannot_be_looked_for_is_logged_once_and_keeps_nobody_out(
    tmp_path: Path, postgres: Server
) -> None:
    with several(tmp_path, postgres.new_database(), 1) as (one,):
        another = await asyncpg.connect(one.database)
        try:
            await another.execute(f"SELECT pg_advisory_lock({SLOT_LOCKS}, 200)")
            # A file with such a name is an OSError, as a stale folder on the network is.
            await another.execute(
                "INSERT INTO editor (slot, life, url, version, beat_at, mark) VALUES"
                f" (200, '\\x00', 'http://another', 'x', {_NOW} + 3600000000, repeat('x', 300))"
            )
            await wait_until(lambda: "cannot be read" in one.log.read_text())
            await another.execute("DELETE FROM editor WHERE slot = 200")
        finally:
            await another.close()
        two = OneOfSeveral(one.data, one.database, 2)
        await asyncio.to_thread(two.start)
        two.kill()
        assert one.log.read_text().count("cannot be read") == 1


async def test_an_editor_that_died_with_its_last_beat_in_the_future_counts_for_nothing(
    tmp_path: Path, postgres: Server
) -> None:
    # Its last beat is in the future once somebody has set the clock of the database back.
    with several(tmp_path, postgres.new_database(), 2) as (one, two):
        graph = asked(two, "POST", "/api/graphs", json={"name": "task"})["id"]
        link = asked(two, "POST", "/api/members", json={"name": "Kadri", "role": "viewer"})

        def listed() -> list[Any]:
            """Return who is in the graph, as one editor lists it."""
            found = [each for each in asked(one, "GET", "/api/graphs") if each["id"] == graph]
            return [person["name"] for each in found for person in each.get("people", ())]

        async with httpx.AsyncClient(base_url=two.url, trust_env=False) as browser:
            proof = {"invitation": link["links"][0]["path"].partition("=")[2]}
            origin = {"origin": two.url}
            assert (await browser.post("/api/session", json=proof, headers=origin)).is_success
            cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
            async with two.socket(graph, cookie=cookie, **origin) as socket:
                await socket.send_bytes(bytes([1, 6, 1, 7, 1, 2]) + b"{}")  # presence: client 7, {}
                await wait_until(lambda: listed() == ["Kadri"])
                two.kill()
                postgres.sql(
                    "UPDATE editor SET beat_at = beat_at + 3600000000, slot = 5, proof = '\\x00'"
                    " WHERE slot = 1",
                    one.database.rpartition("/")[2],
                )
        await wait_until(lambda: listed() == [])
        await asyncio.to_thread(two.start)
