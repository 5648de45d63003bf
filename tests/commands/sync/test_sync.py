"""A folder and a server in step: whatever people write at whichever moment, nothing of it is lost."""

import contextlib
import fcntl
import itertools
import json
import os
import random
import socket
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.cli import main
from action_assistant.commands.client import Server
from action_assistant.commands.sync.folder import Folder, sha
from action_assistant.commands.sync.sync import SyncRound
from action_assistant.errors import CannotStart
from action_assistant.umrf.files.writing import ENDING
from commands.sync.steps import no_link, round_until
from editor.process import Editor, running
from support.doses import examples
from support.product import TOKEN

#: The functions by which a round reads and changes files.
_MOVES = ("open", "stat", "link", "replace", "unlink")


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
        self.first = b""
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
        """Return the present text of the graph on the server."""
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


def test_conflicting_changes_both_stay_until_a_person_decides(place: Place) -> None:
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


def test_a_deletion_on_one_side_deletes_nothing_on_the_other(place: Place) -> None:
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


@pytest.mark.parametrize("links", [True, False], ids=["links", "no-links"])
@pytest.mark.parametrize("seed", range(examples(20) // 2))
def test_nothing_that_anybody_wrote_is_lost(
    place: Place, seed: int, links: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person writes into the file between any two steps of a round."""
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
            fresh.replace(file)

    def meanwhile() -> None:
        if dice.random() < 0.1:
            mark = f"mark{next(marks)}"
            written[mark] = "there"
            change = {"description": mark}
            place.http.patch(f"/api/graphs/{place.graph}", json=change)
        if dice.random() < 0.1:
            _unwatched(monkeypatch, write, meanwhile, links)

    _unwatched(monkeypatch, write, meanwhile, links)
    for _ in range(6):
        _watch(monkeypatch, meanwhile, links)
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


def _watch(monkeypatch: pytest.MonkeyPatch, meanwhile: Callable[[], None], links: bool) -> None:
    """Call `meanwhile` before each step in which a round moves files."""
    if not links:
        monkeypatch.setattr(os, "link", no_link)
    for move in _MOVES:
        original = getattr(os, move)

        def moved(*places: Any, original: Any = original, **more: Any) -> Any:
            if "dir_fd" in more or "src_dir_fd" in more:
                meanwhile()
            return original(*places, **more)

        monkeypatch.setattr(os, move, moved)


def _unwatched(
    monkeypatch: pytest.MonkeyPatch,
    work: Callable[[], None],
    meanwhile: Callable[[], None],
    links: bool,
) -> None:
    """While people write, they are not interrupted themselves."""
    monkeypatch.undo()
    work()
    _watch(monkeypatch, meanwhile, links)


def _all_texts(place: Place) -> str:
    """Return all texts that were ever stored, on the server and in the folder."""
    graph = place.graph
    newest = place.http.get(f"/api/graphs/{graph}").json()["seq"]
    moments = [
        place.http.get(f"/api/graphs/{graph}/umrf", params={"at": seq}).text
        for seq in range(1, newest + 1)
    ]
    here = [p.read_text() for p in place.folder.iterdir() if not p.name.startswith(".action")]
    return "\n".join([*moments, *here])


# A round that ends, or whose system call fails, at each of its steps, in a process of its own.


def _changed_there(place: Place, file: Path) -> None:
    place.http.patch(f"/api/graphs/{place.graph}", json={"description": "there"})


def _changed_on_both_sides(place: Place, file: Path) -> None:
    _changed_there(place, file)
    file.write_bytes(_edited(place.first, 0, "here"))


def _changed_on_both_sides_alike(place: Place, file: Path) -> None:
    _changed_there(place, file)
    file.write_text(json.dumps(json.loads(place.first) | {"graph_description": "here"}))


def _new_there(place: Place, file: Path) -> None:
    place.http.post("/api/graphs", json={"name": "second"})


def _new_here(place: Place, file: Path) -> None:
    file.with_name(f"second{ENDING}").write_bytes(_text("here").replace(b"pair", b"second"))


_CHANGES = (
    *(_changed_there, _changed_on_both_sides, _changed_on_both_sides_alike),
    *(_new_there, _new_here),
)


_WAYS = [("kill", True), ("kill", False), ("fail", True), ("fail", False), ("half", False)]


@pytest.mark.turns
@pytest.mark.parametrize(
    ("how", "links"),
    _WAYS,
    ids=[f"{how}-{'links' if links else 'no-links'}" for how, links in _WAYS],
)
@pytest.mark.parametrize("change", _CHANGES, ids=[each.__name__[1:] for each in _CHANGES])
def test_a_round_that_ends_at_any_step_loses_nothing_and_the_next_ones_finish_it(
    editor: Editor,
    tmp_path: Path,
    how: str,
    change: Callable[[Place, Path], None],
    links: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # `make soak` tries each step; elsewhere each combination tries some, and all of them most.
    stride = 1 if how == "half" else max(1, 80 // examples(20))
    reached = 0
    for number in itertools.count(
        1 + zlib.crc32(f"{how}{change.__name__}{links}".encode()) % stride, stride
    ):
        (folder := tmp_path / str(number)).mkdir()
        with editor.client() as http:
            place = Place(http, folder)
            file = folder / f"pair{ENDING}"
            file.write_bytes(_text())
            place.round()
            place.first = place.server_text()
            file.chmod(0o640)
            change(place, file)
            theirs = {path.name: path.read_bytes() for path in folder.glob(f"*{ENDING}")}
            steps = number, how, folder
            if not round_until(*steps, http.base_url, http.headers, links=links):
                break
            reached += 1
            if not links:
                monkeypatch.setattr(os, "link", no_link)
            left = [place.round() for _ in range(4)][-1]
            monkeypatch.undo()
            _judge(place, change, left, theirs)
    assert reached >= (1 if how != "half" else change is not _new_here)


def _judge(
    place: Place, change: Callable[[Place, Path], None], left: list[str], theirs: dict[str, bytes]
) -> None:
    """Check that both sides are in step after one round, and that each conflict is reported."""
    graphs = {each["name"]: each["id"] for each in place.http.get("/api/graphs").json()}
    names = sorted(path.name for path in place.folder.iterdir() if path.name[0] != ".")
    is_conflict = change is _changed_on_both_sides_alike
    is_two = change in {_new_there, _new_here}
    copies = [f"pair{ENDING}.server"] if is_conflict else []
    assert names == [f"pair{ENDING}", *copies, *([f"second{ENDING}"] if is_two else [])]
    assert sorted(graphs) == (["pair", "second"] if is_two else ["pair"])
    assert len(left) == is_conflict
    file = place.folder / f"pair{ENDING}"
    assert file.stat().st_mode & 0o777 == 0o640
    if is_conflict:
        assert file.read_bytes() == theirs[file.name]
        assert (file.with_name(copies[0]).stat().st_mode & 0o777) == 0o640
        return
    for name, graph in graphs.items():
        now = place.http.get(f"/api/graphs/{graph}/umrf").content
        here = (place.folder / f"{name}{ENDING}").read_bytes()
        assert here == now or (change is _new_here and here == theirs[f"{name}{ENDING}"])
    hidden = [path.name for path in place.folder.iterdir() if path.name[0] == "."]
    assert hidden == [".action-assistant-sync.json"]
    if change is _changed_on_both_sides:
        assert b"here" in file.read_bytes()
        assert b"there" in file.read_bytes()


# Foreign things that a folder may have under the name of a graph, and that a state may name.


def _link_to_a_file(place: Path, outside: Path) -> None:
    outside.write_bytes(_text("outside"))
    place.symlink_to(outside)


def _link_to_nowhere(place: Path, outside: Path) -> None:
    place.symlink_to(outside)


def _link_to_itself(place: Path, outside: Path) -> None:
    place.symlink_to(place.name)


def _folder(place: Path, outside: Path) -> None:
    place.mkdir()
    (place / "inside").write_bytes(b"mine")


def _fifo(place: Path, outside: Path) -> None:
    os.mkfifo(place)


def _socket(place: Path, outside: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening, contextlib.chdir(place.parent):
        listening.bind(place.name)


_THINGS = (_link_to_a_file, _link_to_nowhere, _link_to_itself, _folder, _fifo, _socket)


@pytest.mark.turns
@pytest.mark.parametrize("when", ["new", "known", "named by a graph", "copy"])
@pytest.mark.parametrize("thing", _THINGS, ids=[each.__name__[1:] for each in _THINGS])
def test_a_link_or_folder_in_place_of_a_file_is_reported_and_other_files_go_on(
    place: Place, tmp_path_factory: pytest.TempPathFactory, thing: Callable[..., None], when: str
) -> None:
    outside = tmp_path_factory.mktemp("outside") / "secret"
    odd, fine = place.folder / f"odd{ENDING}", place.folder / f"pair{ENDING}"
    if when == "known":
        odd.write_bytes(_text("0").replace(b"pair", b"odd"))
        place.round()
        odd.unlink()
    fine.write_bytes(_text("fine"))
    if when == "copy":
        place.round()
        _changed_there(place, fine)
        fine.write_bytes(fine.read_bytes().replace(b"pair", b"mine"))
        place.http.patch(f"/api/graphs/{place.graph}", json={"name": "theirs"})
        odd = fine.with_name(f"{fine.name}.server")
    if when == "named by a graph":
        place.http.post("/api/graphs", json={"name": "odd"})
    thing(odd, outside)
    before = (odd.lstat(), outside.read_bytes() if outside.exists() else None)
    for _ in range(2):
        left = place.round()
        assert len(left) == 1
        assert left[0].startswith(fine.name if when == "copy" else f"{odd.name}: cannot be kept")
    after = (odd.lstat(), outside.read_bytes() if outside.exists() else None)
    assert (after[0].st_ino, after[0].st_mode, after[1]) == (
        *(before[0].st_ino, before[0].st_mode),
        before[1],
    )
    names = [each["name"] for each in place.http.get("/api/graphs").json()]
    told = "".join(
        place.http.get(f"/api/graphs/{each['id']}/umrf").text
        for each in place.http.get("/api/graphs").json()
    )
    assert "outside" not in told
    match when:
        case "new":
            assert names == ["pair"]
        case "named by a graph":
            assert (place.folder / f"odd-2{ENDING}").is_file()
        case "copy":
            copy = fine.with_name(f"{fine.name}.server-2")
            assert "theirs" in copy.read_text()
            copy.unlink()
            assert place.round() == []
        case _:
            assert sorted(names) == ["odd", "pair"]


@pytest.mark.parametrize(
    "name",
    [
        *("../victim/x.umrf.graph.json", "/etc/x.umrf.graph.json", "a/../../x.umrf.graph.json"),
        *("..", ".", "", ".hidden.umrf.graph.json", "x\0.umrf.graph.json", "passwd"),
    ],
)
def test_a_state_that_names_what_is_not_in_the_folder_is_not_believed(
    place: Place, tmp_path: Path, name: str
) -> None:
    (place.folder / "in").mkdir()
    place.folder /= "in"
    (tmp_path / "victim").mkdir()
    for victim in (tmp_path / "victim" / "x.umrf.graph.json", tmp_path / "x.umrf.graph.json"):
        victim.write_bytes(_text("secret"))
    (place.folder / f"pair{ENDING}").write_bytes(_text("fine"))
    place.round()
    state = place.folder / ".action-assistant-sync.json"
    entries = json.loads(state.read_bytes())
    entries[name] = next(iter(entries.values())) | {"sha": "0" * 64}
    state.write_text(json.dumps(entries))
    _changed_there(place, place.folder)
    (left,) = place.round()
    assert "is not used" in left
    assert name in json.loads(state.read_bytes())
    assert b"secret" not in place.server_text()
    assert b"there" in (place.folder / f"pair{ENDING}").read_bytes()
    assert {path.read_bytes() for path in tmp_path.glob("**/x.umrf.graph.json")} == {
        _text("secret")
    }


@pytest.mark.parametrize(
    "entry",
    [
        {"graph": "../../people", "seq": 1, "sha": "0" * 64},
        {"graph": "a", "seq": -1, "sha": "0" * 64},
        {"graph": "a", "seq": 1, "sha": "../x"},
        {"graph": "a", "seq": 1, "sha": None, "aside": {"token": "../../x", "sha": "0" * 64}},
        {"graph": "a", "seq": 1, "sha": None, "coming": {"token": "..", "seq": 1, "sha": "0" * 64}},
        {"graph": "a", "seq": 1, "sha": None, "copy": 0},
        [],
        None,
    ],
)
def test_an_entry_of_the_state_that_is_none_leaves_its_file_alone(
    place: Place, entry: object
) -> None:
    (place.folder / f"odd{ENDING}").write_bytes(_text("secret"))
    state = place.folder / ".action-assistant-sync.json"
    state.write_text(json.dumps({f"odd{ENDING}": entry}))
    (place.folder / f"pair{ENDING}").write_bytes(_text("fine"))
    for _ in range(2):
        (left,) = place.round()
        assert left.startswith(f"odd{ENDING}: its entry")
    assert (place.folder / f"odd{ENDING}").read_bytes() == _text("secret")
    assert json.loads(state.read_bytes())[f"odd{ENDING}"] == entry
    assert b"fine" in place.server_text()


@pytest.mark.parametrize("thing", _THINGS, ids=[each.__name__[1:] for each in _THINGS])
def test_a_state_that_is_no_file_is_named_and_nothing_is_done(
    place: Place, tmp_path_factory: pytest.TempPathFactory, thing: Callable[..., None]
) -> None:
    thing(place.folder / ".action-assistant-sync.json", tmp_path_factory.mktemp("o") / "secret")
    (place.folder / f"pair{ENDING}").write_bytes(_text())
    with pytest.raises(CannotStart, match=r"action-assistant-sync\.json"):
        place.round()
    assert place.http.get("/api/graphs").json() == []


@pytest.mark.turns
@pytest.mark.parametrize("mode", [0o640, 0o600, 0o444, 0o664])
@pytest.mark.parametrize("links", [True, False], ids=["links", "no-links"])
def test_a_file_and_its_copy_stay_as_open_to_others_as_the_file_was(
    place: Place, mode: int, links: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", no_link)
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    file.chmod(mode)
    _changed_there(place, file)
    place.round()
    assert b"there" in file.read_bytes()
    assert file.stat().st_mode & 0o777 == mode
    place.first = place.server_text()
    file.chmod(0o600)
    _changed_on_both_sides_alike(place, file)
    place.http.patch(f"/api/graphs/{place.graph}", json={"description": "again"})
    file.chmod(mode)
    place.round()
    copy = file.with_name(f"{file.name}.server")
    assert copy.stat().st_mode & 0o777 == mode


def test_a_copy_that_somebody_has_under_that_name_stays(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    place.first = place.server_text()
    mine = file.with_name(f"{file.name}.server")
    mine.write_bytes(b"notes about the server")
    _changed_on_both_sides_alike(place, file)
    for _ in range(2):
        (left,) = place.round()
        assert f"{file.name}.server-2:" in left
    assert mine.read_bytes() == b"notes about the server"
    file.with_name(f"{file.name}.server-2").unlink()
    assert place.round() == []
    assert mine.read_bytes() == b"notes about the server"


def test_a_file_that_an_earlier_version_put_aside_comes_back(place: Place) -> None:
    file = place.folder / f"pair{ENDING}"
    file.write_bytes(_text())
    place.round()
    text = file.read_bytes()
    file.rename(file.with_name(f".{file.name}.{sha(text)}.aside"))
    assert place.round() == []
    assert file.read_bytes() == text
    file.rename(file.with_name(f".{file.name}.{'0' * 64}.aside"))
    place.round()
    (kept,) = place.folder.glob(f"{file.name}.mine-*")
    assert kept.read_bytes() == text


def test_a_file_whose_name_is_not_utf8_is_named_and_left(place: Place) -> None:
    odd = os.fsencode(place.folder) + b"/\xff" + ENDING.encode()
    with open(odd, "wb") as file:  # noqa: PTH123 - a Path cannot say it
        file.write(_text("odd"))
    (place.folder / f"pair{ENDING}").write_bytes(_text("fine"))
    (left,) = place.round()
    assert "not UTF-8" in left
    assert b"fine" in place.server_text()


def test_a_name_as_long_as_names_can_be_is_kept_in_step(place: Place) -> None:
    file = place.folder / ("x" * (255 - len(ENDING)) + ENDING)
    file.write_bytes(_text())
    assert place.round() == []
    _changed_there(place, file)
    assert place.round() == []
    assert b"there" in file.read_bytes()


def test_a_second_sync_of_a_folder_is_refused(
    editor: Editor,
    place: Place,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
    at = os.open(place.folder, os.O_RDONLY)
    try:
        fcntl.flock(at, fcntl.LOCK_EX)
        words = ["sync", str(place.folder), "--url", editor.url, "--data", str(editor.data)]
        assert main(words) == 2
    finally:
        os.close(at)
    assert "Another `sync` is at work" in capfd.readouterr().err
    assert main(words) == 0
