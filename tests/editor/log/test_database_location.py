"""Graphs that are elsewhere are not passed over in silence: the folder remembers where they are."""

import asyncio
import subprocess
from pathlib import Path
from typing import Any

import pytest

from action_assistant.editor.app import create_app, open_services
from action_assistant.editor.log import database_location
from action_assistant.errors import CannotStart
from action_assistant.journal.journal import Journal
from action_assistant.settings import EditorSettings
from editor.process import Editor, running
from journal.servers import Server
from support.product import COMMAND, Product


def refused(data: Path, *flags: str) -> str:
    """Return the message of an editor that refuses to start."""
    product = Product(data, *flags)
    ended = subprocess.run(
        [*COMMAND, "serve", "--data", data, "--port", str(product.port), "--no-open", *flags],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert ended.returncode == 2, ended.stderr
    return ended.stderr


def names(editor: Editor) -> set[str]:
    with editor.client() as http:
        return {each["name"] for each in http.get("/api/graphs").json()}


@pytest.mark.long
def test_another_database_than_before_is_refused_unless_told(
    tmp_path: Path, postgres: Server
) -> None:
    data, url = tmp_path / "data", postgres.new_database()
    own = f"sqlite:///{data / 'editor.db'}"
    with running(data) as editor, editor.client() as http:
        http.post("/api/graphs", json={"name": "mine"}).raise_for_status()
        count = len(names(editor))
    said = refused(data, "--database", url)
    assert f"{count} graphs" in said
    assert str(data / "editor.db") in said
    assert "backup FILE" in said
    assert "--switch-database" in said
    postgres.sql("CREATE TABLE event (nothing TEXT); DROP TABLE event", url.rpartition("/")[2])

    database_location.check(data, url, switch=True)
    product = Product(data, "--database", url, "--switch-database")
    product.start()
    product.end()
    database_location.check(data, url, switch=False)  # told once
    # Another name of the same server leads to the same log.
    database_location.check(data, url.replace("127.0.0.1", "localhost"), switch=False)
    said = refused(data, "--database", own)
    assert database_location.shown(url) in said
    assert "without --database" in said
    with pytest.raises(CannotStart, match="would not be seen"):
        database_location.check(data, own, switch=False)
    with pytest.raises(CannotStart, match="would not be seen"):
        database_location.check(data, postgres.new_database(), switch=False)


def test_a_folder_serves_the_database_that_it_remembers(tmp_path: Path, postgres: Server) -> None:
    data = tmp_path / "data"
    with running(data, postgres.new_database()) as editor, editor.client() as http:
        http.post("/api/graphs", json={"name": "mine"}).raise_for_status()
    with running(data) as editor:
        assert "mine" in names(editor)
    assert not (data / "editor.db").exists()
    own = f"sqlite:///{data / 'editor.db'}"
    assert database_location.to_serve(data, switch=True) == own
    with pytest.raises(CannotStart, match="which the folder remembers"):
        database_location.check(data, own, switch=False)
    database_location.remember(data, f"sqlite:///{tmp_path / 'gone.db'}")
    with pytest.raises(CannotStart, match=r"There is no .*gone\.db"):
        database_location.to_serve(data, switch=False)


def test_a_folder_without_graphs_takes_any_database(tmp_path: Path, postgres: Server) -> None:
    database_location.check(tmp_path, postgres.new_database(), switch=False)
    from action_assistant.editor.log import graph_events as h
    from action_assistant.journal.journal import Journal

    async def empty() -> None:
        url = f"sqlite:///{tmp_path / 'editor.db'}"
        await (await Journal.open(url, branch="editor", fold=h.fold)).close()

    asyncio.run(empty())
    database_location.check(tmp_path, postgres.new_database(), switch=False)


def test_a_database_that_an_older_version_did_not_record_is_asked_for(
    tmp_path: Path, postgres: Server
) -> None:
    url = postgres.new_database()
    with running(tmp_path / "data", url):
        pass
    (tmp_path / "data" / database_location.FILE).unlink()
    with pytest.raises(CannotStart, match="name it by --database URL, or begin without"):
        database_location.check(
            tmp_path / "data", f"sqlite:///{tmp_path / 'data/editor.db'}", switch=False
        )
    with pytest.raises(CannotStart, match="name it by --database"):
        database_location.of(tmp_path / "data")
    database_location.check(tmp_path / "data", url, switch=False)


def test_the_folder_keeps_no_password(tmp_path: Path) -> None:
    url = "postgresql://ann:secret@db:5433/graphs?ssl=require&sslpassword=hidden"
    database_location.remember(tmp_path, url)
    kept = (tmp_path / database_location.FILE).read_text()
    assert "secret" not in kept
    assert "hidden" not in kept
    assert database_location.of(tmp_path) == "postgresql://ann@db:5433/graphs?ssl=require"
    assert (tmp_path / database_location.FILE).stat().st_mode & 0o777 == 0o600
    database_location.remember(tmp_path, f"sqlite:///{tmp_path / 'editor.db'}")
    assert database_location.of(tmp_path) == f"sqlite:///{tmp_path / 'editor.db'}"


def test_a_database_that_does_not_answer_is_not_taken_for_another_one(tmp_path: Path) -> None:
    with running(tmp_path / "data"):
        pass
    with pytest.raises(CannotStart, match=r"127\.0\.0\.1:1/graphs cannot be read"):
        database_location.check(
            tmp_path / "data", "postgresql://ann:x@127.0.0.1:1/graphs", switch=False
        )


def test_a_file_elsewhere_that_is_not_there_now_is_no_empty_catalogue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    database_location.remember(tmp_path, "sqlite:///mounted/graphs.db")
    monkeypatch.chdir("/")
    assert database_location.of(tmp_path) == f"sqlite:///{tmp_path / 'mounted/graphs.db'}"
    with pytest.raises(CannotStart, match=r"There is no .*mounted/graphs.db, where"):
        database_location.journal_of(tmp_path, None)
    own = f"sqlite:///{tmp_path / 'editor.db'}"
    with pytest.raises(CannotStart, match=r"The graphs of .* would not be seen without"):
        database_location.check(tmp_path, own, switch=False)
    database_location.check(tmp_path, database_location.of(tmp_path), switch=False)


@pytest.mark.parametrize("step", ["prepare", "open"])
def test_a_start_during_a_move_does_not_forget_where_the_graphs_went(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    data, there = tmp_path / "data", tmp_path / "there.db"
    with running(data) as editor, editor.client() as http:
        http.post("/api/graphs", json={"name": "mine"}).raise_for_status()
    settings = EditorSettings(data=data, database=f"sqlite:///{data / 'editor.db'}")
    real = getattr(Journal, step)

    def late(*arguments: Any, **options: Any) -> Any:
        (data / "editor.db").rename(there)
        database_location.remember(data, f"sqlite:///{there}")
        return real(*arguments, **options)

    monkeypatch.setattr(Journal, step, late)

    async def serve() -> None:
        async with open_services(settings):
            raise AssertionError("an empty catalogue is served")

    start = (lambda: create_app(settings)) if step == "prepare" else lambda: asyncio.run(serve())
    with pytest.raises(CannotStart, match="would not be seen"):
        start()
    assert database_location.remembered(data) == f"sqlite:///{there}"
