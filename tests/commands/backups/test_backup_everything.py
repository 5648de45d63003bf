"""A server with everything in it → backup while it is used → an empty machine → equal."""

import asyncio
import contextlib
import os
import re
import subprocess
import threading
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from action_assistant.editor.log import graph_events as h
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.runner.projection import fold as runner_fold
from action_assistant.web.network.certificate import Certificate
from journal.servers import Server
from support.command_line import ran
from support.product import Product, running
from support.used_server import Guest, answers, differences, live


class Keyed(Product):
    """A server whose token is in its data folder, and nowhere else."""

    @property
    def environment(self) -> dict[str, str]:
        """Return the environment of commands, without the token."""
        found = {**super().environment}
        del found["ACTION_ASSISTANT_TOKEN"]
        return found

    @property
    def token(self) -> str:
        """Return the token that the data folder holds."""
        return (self.data / "token").read_text().strip()


@contextlib.contextmanager
def kept(data: Path, *flags: str) -> Iterator[Keyed]:
    """Such a server, running inside the block."""
    product = Keyed(data, *flags)
    try:
        product.start()
        yield product
    finally:
        product.end()


def command(*arguments: "str | Path") -> "subprocess.CompletedProcess[str]":
    kept = {key: text for key, text in os.environ.items() if "ACTION_ASSISTANT" not in key}
    return ran(*arguments, environ=kept)


async def events(url: str, data: Path) -> tuple[list[Event], list[Event]]:
    """Return all events of both journals, which have to be sound."""
    found = []
    for branch, place, fold in (
        ("editor", url, h.fold),
        ("runner", f"sqlite:///{data / 'runner.db'}", runner_fold),
    ):
        journal = await Journal.open(place, branch=branch, fold=fold)  # type: ignore[arg-type]
        assert await journal.verify() == []
        found.append(await journal.read_all(limit=1_000_000))
        await journal.close()
    return found[0], found[1]


def let_in(product: Product, links: list[str], mia: str | None) -> None:
    """The links and the session of before are good."""
    for link in links:
        with Guest(product, "Zoe", {"invitation": link}) as guest:
            assert guest.person["name"] == "Zoe"
    with Guest(product, "", {}) as guest:
        guest.http.cookies.set(f"aa_{product.port}", mia)
        answer = guest.http.get("/api/session").json()
        assert answer["person"]["name"] == "Mia"


def assert_rehearsed(file: Path, data: Path) -> None:
    """A trial of it finds everything, and leaves nothing behind."""
    done = command("restore", "--rehearse", file, "--data", data)
    assert done.returncode == 0, done.stdout
    some = r"[1-9]\d*"
    assert re.search(rf"graphs, {some} versions, {some} links, {some} people", done.stdout)
    assert re.search(rf"runs, {some} of them in archives, 1 robots", done.stdout)
    assert [path for path in data.iterdir() if path.name.startswith(".")] == []


@pytest.mark.long
def test_backup_restores_the_whole_server_on_an_empty_machine(
    tmp_path: Path, postgres: Server
) -> None:
    """Events, answers, archived runs, keys, links, sessions, certificates."""
    old, new = tmp_path / "old", tmp_path / "new"
    urls = [postgres.new_database(), postgres.new_database()]
    flags = [["--database", url] for url in urls]
    file = tmp_path / "monday.zip"
    with kept(old, *flags[0]) as product:
        links = asyncio.run(live(product, product.token))
        Certificate(old).renew(["lab.test"])
        hour = old / "recordings" / "Marian" / "2026-11-22T09.jsonl.gz"
        hour.parent.mkdir(parents=True)
        hour.write_bytes(b"as engines sent them")
        with Guest(product, "Mia", {"invitation": links[0]}) as guest:
            said = answers(product, product.token)
            cookie = next(iter(guest.http.cookies.jar)).value
        made = command("backup", file, "--data", old)  # the folder knows its database
        assert made.returncode == 0, made.stdout + made.stderr
        assert "whoever reads it can sign in" in made.stdout
    assert file.stat().st_mode & 0o777 == 0o600
    before = asyncio.run(events(urls[0], old))
    assert_rehearsed(file, old)

    back = command("restore", file, "--data", new, *flags[1])
    assert back.returncode == 0, back.stderr
    after = asyncio.run(events(urls[1], new))
    newest = after[0].pop()  # open pages have to notice
    assert (newest.stream, newest.position) == ("epochs", len(after[0]) + 1)
    assert after[0] == before[0][: len(after[0])]
    assert after[1] == before[1]
    mine = [path for path in new.rglob("*") if path.suffix != ".lock"]
    assert [path for path in mine if path.stat().st_mode & 0o077] == []
    for name in ("token", "tls/ca.pem", "tls/ca-key.pem", hour.relative_to(old)):
        assert (new / name).read_bytes() == (old / name).read_bytes()
    with kept(new, *flags[1]) as product:
        assert list(differences(said, answers(product, product.token))) == []
        let_in(product, links, cookie)
    assert command("verify", "--data", new).returncode == 0
    assert "editor: " in command("verify", "--data", new).stdout


@pytest.mark.long
def test_a_backup_holds_concurrent_edits_up_to_one_moment(tmp_path: Path, postgres: Server) -> None:
    url, data = postgres.new_database(), tmp_path / "data"
    over = threading.Event()
    with running(data, "--database", url) as product:

        def draw() -> None:
            with product.editor() as http:
                graph = http.post("/api/graphs", json={"name": "busy"}).json()["id"]
                number = 0
                while not over.is_set():
                    number += 1
                    http.patch(f"/api/graphs/{graph}", json={"name": f"busy {number}"})

        drawing = threading.Thread(target=draw)
        drawing.start()
        try:
            time.sleep(0.3)
            made = command("backup", tmp_path / "x.zip", "--data", data)
        finally:
            over.set()
            drawing.join()
    assert made.returncode == 0, made.stderr
    whole = asyncio.run(events(url, data))[0]
    back = command("restore", tmp_path / "x.zip", "--data", tmp_path / "new")
    assert back.returncode == 0, back.stderr
    there = f"sqlite:///{tmp_path / 'new' / 'editor.db'}"
    some = asyncio.run(events(there, tmp_path / "new"))[0][:-1]
    assert some == whole[: len(some)]
    assert 20 < len(some) < len(whole)


@pytest.mark.long
def test_a_database_that_cannot_be_reached_makes_no_backup(
    tmp_path: Path, postgres: Server
) -> None:
    data = tmp_path / "data"
    with kept(data, "--database", postgres.new_database()):
        pass
    kept_url = (data / "editor.database").read_text()
    (data / "editor.database").write_text(kept_url.replace(str(postgres.port), "1"))
    made = command("backup", tmp_path / "x.zip", "--data", data)
    assert made.returncode == 2
    assert "127.0.0.1" in made.stderr
    assert not (tmp_path / "x.zip").exists()
    # An older version knew that there are graphs, but not in which database.
    (data / "editor.database").unlink()
    made = command("backup", tmp_path / "x.zip", "--data", data)
    assert made.returncode == 2
    assert "name it by --database" in made.stderr
    assert command("verify", "--data", data).returncode == 2


@pytest.mark.long
def test_a_backup_names_missing_parts_and_exits_with_1(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with kept(data) as product:
        asyncio.run(live(product, product.token))
    gone, bad = sorted((data / "archive").glob("runs/*/*.gz"))[:2]
    gone.unlink()
    bad.write_bytes(bad.read_bytes()[:-1] + b"\1")
    (data / "token").unlink()
    made = command("backup", tmp_path / "x.zip", "--data", data)
    assert made.returncode == 1
    for what in (gone.name, bad.name, "the token"):
        assert f"{what}" in made.stdout
    assert made.stdout.count("missing: ") == 3
    assert zipfile.is_zipfile(tmp_path / "x.zip")
    back = command("restore", tmp_path / "x.zip", "--data", tmp_path / "new")
    assert back.returncode == 0
    assert back.stdout.count("missing in the backup: ") == 3
