"""A folder and a server in step: whatever people write at whichever moment, nothing of it is lost."""

import itertools
import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.commands.client import Server
from action_assistant.commands.sync.folder import Folder
from action_assistant.commands.sync.sync import SyncRound
from action_assistant.umrf.files.file_names import ENDING
from editor.process import Editor, running
from support.doses import examples

_MOVES = ("rename", "replace", "link", "unlink", "read_bytes")


@pytest.fixture(scope="module")
def editor(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """An editor of the module's own: `sync` takes all graphs."""
    with running(tmp_path_factory.mktemp("sync") / "data") as found:
        yield found


class Place:
    """A folder, a graph in it and on the server, and people who write in both."""

    def __init__(self, http: httpx.Client, folder: Path) -> None:
        self.http = http
        self.folder = folder
        self.said: list[str] = []
        for graph in http.get("/api/graphs").json():
            http.delete(f"/api/graphs/{graph['id']}")

    def round(self) -> list[str]:
        """One round; what is left."""
        syncing = SyncRound(Server(self.http, ""), Folder(self.folder), self.said.append)
        syncing.run()
        return syncing.left

    @property
    def graph(self) -> str:
        """The id of the one graph."""
        (found,) = self.http.get("/api/graphs").json()
        return str(found["id"])

    def file(self) -> Path:
        """The one file."""
        (found,) = [p for p in self.folder.glob(f"*{ENDING}") if not p.name.startswith(".")]
        return found

    def server_text(self) -> bytes:
        """What the graph is now."""
        return self.http.get(f"/api/graphs/{self.graph}/umrf").content


@pytest.fixture
def place(editor: Editor, tmp_path: Path) -> Any:
    """One place."""
    with editor.client() as http:
        yield Place(http, tmp_path)


def _text(mark: str = "0", action: str = "Dock") -> bytes:
    actions = [{"name": action, "type": "sync", "description": mark}, {"name": "Charge"}]
    return json.dumps({"graph_name": "pair", "actions": actions}).encode()


def _edited(text: bytes, where: int, mark: str) -> bytes:
    value = json.loads(text)
    value["actions"][where]["description"] = mark
    return json.dumps(value).encode()


def test_a_new_file_becomes_a_graph_and_a_new_graph_a_file(place: Place) -> None:
    (place.folder / f"pair{ENDING}").write_bytes(_text())
    assert place.round() == []
    place.http.post("/api/graphs", json={"name": "Ünter ../weg"})
    assert place.round() == []
    names = sorted(path.name for path in place.folder.iterdir() if path.name[0] != ".")
    assert names == [f"nter_.._weg{ENDING}", f"pair{ENDING}"]
    assert place.round() == []
    assert len(place.http.get("/api/graphs").json()) == 2


def test_a_change_here_goes_there_and_the_file_stays_as_it_was_written(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    file.write_bytes(odd := _edited(place.server_text(), 0, "odd").replace(b" ", b"  "))
    assert place.round() == []
    assert file.read_bytes() == odd
    assert b'"odd"' in place.server_text()


def test_a_change_there_comes_here(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    place.http.patch(f"/api/graphs/{place.graph}", json={"description": "there"})
    assert place.round() == []
    assert file.read_bytes() == place.server_text()


def test_changes_of_both_that_do_not_meet_are_merged(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    file.write_bytes(_edited(place.server_text(), 0, "here"))
    place.http.patch(f"/api/graphs/{place.graph}", json={"description": "there"})
    assert place.round() == []
    assert file.read_bytes() == place.server_text()
    assert b"here" in file.read_bytes()
    assert b"there" in file.read_bytes()


def test_where_both_changed_the_same_both_stay_until_somebody_has_looked(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    mine = json.loads(place.server_text()) | {"graph_description": "here"}
    file.write_text(json.dumps(mine))
    place.http.patch(f"/api/graphs/{place.graph}", json={"description": "there"})
    for _ in range(2):
        (left,) = place.round()
        assert "the same was changed" in left
    assert json.loads(file.read_bytes())["graph_description"] == "here"
    copy = file.with_name(f"{file.name}.server")
    assert json.loads(copy.read_bytes())["graph_description"] == "there"
    copy.unlink()
    assert place.round() == []
    assert json.loads(place.server_text())["graph_description"] == "here"


def test_what_is_deleted_on_one_side_stays_on_the_other(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    file.unlink()
    assert place.round() == []
    assert not file.exists()
    assert place.graph
    file.write_bytes(place.server_text())
    assert place.round() == []
    place.http.delete(f"/api/graphs/{place.graph}")
    (left,) = place.round()
    assert "the file stays" in left
    assert file.exists()


def test_a_file_that_cannot_be_read_is_named_with_its_place_and_left(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    file.write_bytes(b'{"graph_name": "pair", "actions": [}')
    (left,) = place.round()
    assert left.startswith(f"pair{ENDING}: ")
    assert file.read_bytes().endswith(b"[}")


@pytest.mark.parametrize("seed", range(examples(20) // 2))
def test_nothing_that_anybody_wrote_is_lost(
    place: Place, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody writes into the file, or deletes it, between any two steps of a round."""
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    dice, marks = random.Random(seed), itertools.count()
    written: dict[str, str] = {}

    def write() -> None:
        mark = f"mark{next(marks)}"
        text = file.read_bytes() if file.exists() else place.server_text()
        where = dice.randrange(2)
        before = json.loads(text)["actions"][where].get("description")
        written.pop(before, None)  # taken away by who wrote it, or by who saw it
        text = _edited(text, where, mark)
        written[mark] = "here"
        if dice.random() < 0.5 and file.exists():
            with file.open("r+b") as same:  # into the file that is there
                same.write(text)
                same.truncate()
        else:
            fresh = place.folder / "fresh"
            fresh.write_bytes(text)
            os.replace(fresh, file)  # noqa: PTH105 - Path.replace is being watched

    def meanwhile() -> None:
        if dice.random() < 0.1:
            mark = f"mark{next(marks)}"
            written[mark] = "there"
            change = {"description": mark}
            place.http.patch(f"/api/graphs/{place.graph}", json=change)
        if dice.random() < 0.1:
            _unwatched(monkeypatch, write, meanwhile)

    _unwatched(monkeypatch, write, meanwhile)
    for _ in range(6):
        _watch(monkeypatch, meanwhile)
        place.round()
        monkeypatch.undo()
        for copy in place.folder.glob("*.server"):
            copy.unlink()  # somebody has looked
    for _ in range(4):
        place.round()
        for copy in place.folder.glob("*.server"):
            copy.unlink()
    assert place.round() == []
    kept = _all_texts(place)
    assert [mark for mark in written if mark not in kept] == []
    assert json.loads(file.read_bytes())["actions"] == json.loads(place.server_text())["actions"]


def _watch(monkeypatch: pytest.MonkeyPatch, meanwhile: Callable[[], None]) -> None:
    """Something happens before each step that a round does to files."""
    for move in ("rename", "replace", "unlink", "read_bytes"):
        original = getattr(Path, move)

        def moved(self: Path, *more: Any, original: Any = original) -> Any:
            meanwhile()
            return original(self, *more)

        monkeypatch.setattr(Path, move, moved)
    linked = os.link

    def link(*places: Any) -> None:
        meanwhile()
        linked(*places)

    monkeypatch.setattr(os, "link", link)


def _unwatched(
    monkeypatch: pytest.MonkeyPatch, work: Callable[[], None], meanwhile: Callable[[], None]
) -> None:
    """While people write, they are not interrupted themselves."""
    monkeypatch.undo()
    work()
    _watch(monkeypatch, meanwhile)


def _all_texts(place: Place) -> str:
    """Everything that was ever stored, there and here."""
    graph = place.graph
    newest = place.http.get(f"/api/graphs/{graph}").json()["seq"]
    moments = [
        place.http.get(f"/api/graphs/{graph}/umrf", params={"at": seq}).text
        for seq in range(1, newest + 1)
    ]
    here = [p.read_text() for p in place.folder.iterdir() if not p.name.startswith(".action")]
    return "\n".join([*moments, *here])
