"""`restore` writes nothing but a whole backup of ours, into a place that is empty or ours."""

import asyncio
import hashlib
import json
import multiprocessing
import os
import shutil
import signal
import stat
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

from action_assistant import settings
from action_assistant.cli import parser
from action_assistant.commands.backups import restore
from action_assistant.commands.backups.backup_file import Package
from action_assistant.commands.backups.data_folder import checked
from action_assistant.commands.backups.progress import Progress
from action_assistant.editor.log import graph_events as h
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Draft, Fold
from action_assistant.journal.journal import Journal
from action_assistant.journal.lock import own
from action_assistant.runner.projection import fold as runner_fold
from journal.servers import Server

LARGE: Final = 10 << 20


def here(*arguments: str | Path) -> int:
    """A command in this process."""
    options = parser().parse_args(list(map(str, arguments)))
    code: int = options.handler(options)
    return code


def filled(data: Path, name: str, body: bytes = b"") -> None:
    """A data folder with both journals, which tell of `name`, and with keys."""
    folds: dict[Branch, Fold] = {"editor": h.fold, "runner": runner_fold}

    async def fill() -> None:
        for branch, fold in folds.items():
            url = f"sqlite:///{data / f'{branch}.db'}"
            journal = await Journal.open(url, branch=branch, fold=fold)
            draft = h.draft(h.NAMED, "ada", h.PersonNamed(name)) if branch == "editor" else None
            await journal.append("people", [draft or Draft("x.y.v1", "ada", name.encode())])
            await journal.append("graph/g", [Draft("x.y.v1", "ada", body)])
            await journal.close()

    (data / "revoked").mkdir(parents=True)
    (data / "revoked" / "abc").touch()
    (data / "tls").mkdir()
    (data / "tls" / "ca.pem").write_text(f"authority of {name}")
    (data / "tls" / "ca-key.pem").write_text(f"key of {name}")
    (data / "token").write_text(f"token of {name}".ljust(40, "-"))
    asyncio.run(fill())


@pytest.fixture
def data(tmp_path: Path) -> Path:
    filled(tmp_path / "old", "Ada")
    return tmp_path / "old"


@pytest.fixture
def file(data: Path, tmp_path: Path) -> Path:
    assert here("backup", tmp_path / "monday.zip", "--data", data) == 0
    return tmp_path / "monday.zip"


def changed(file: Path, change: Callable[[dict[str, Any], dict[str, bytes]], None]) -> Path:
    """Another file, of which `change` alters what it says of itself, and its parts."""
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    about = json.loads(parts.pop("about.json"))
    change(about, parts)
    other = file.with_name("changed.zip")
    with zipfile.ZipFile(other, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
        archive.writestr("about.json", json.dumps(about))
    return other


HELD: Final = {
    "bytes": 1,
    "sha256": "2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881",
}


def _named(name: str) -> Callable[[dict[str, Any], dict[str, bytes]], None]:
    def change(about: dict[str, Any], parts: dict[str, bytes]) -> None:
        about["files"][name] = HELD
        parts[name] = b"x"

    return change


def _bomb(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    parts["files/token"] = bytes(LARGE)
    about["files"]["files/token"]["bytes"] = LARGE


def _old_bomb(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    about["format"] = 1
    del about["files"], about["journals"]["editor"]["bytes"]
    parts["editor.db"] = bytes(LARGE)


def _larger(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    parts["editor.db"] += b"\0"


def _other(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    parts["files/token"] = parts["files/token"][:-1] + b"!"


def _less(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    del parts["runner.db"]


def _newer(about: dict[str, Any], parts: dict[str, bytes]) -> None:
    about["format"] = 3


HOSTILE: Final = {
    **{
        name: _named(name)
        for name in (
            "files/../../outside",
            "files/..",
            "/etc/outside",
            "outside",
            "files//token",
            "files/tls/../../outside",
            "archive/../token",
            "files/editor.db-wal",
            "files/.bashrc",
            "files/tls\\..\\x",
            "files/tls/a\nb",
        )
    },
    "a bomb": _bomb,
    "a bomb of the older format": _old_bomb,
    "more than it says": _larger,
    "another token": _other,
    "less than it says": _less,
    "a newer format": _newer,
}


@pytest.mark.long
@pytest.mark.parametrize("kind", HOSTILE)
def test_a_file_that_is_not_what_it_says_writes_nothing(
    file: Path, tmp_path: Path, kind: str
) -> None:
    harmful = changed(file, HOSTILE[kind])
    new = tmp_path / "deep" / "new"
    new.parent.mkdir()
    before = sorted(path for path in tmp_path.rglob("*") if path.suffix != ".lock")
    with pytest.raises(CannotStart, match=r"damaged|newer version") as refused:
        here("restore", harmful, "--data", new)
    assert str(harmful) in str(refused.value)
    left = [path for path in tmp_path.rglob("*") if path.suffix != ".lock" and path != new]
    assert sorted(left) == before


def test_a_restore_that_is_refused_leaves_nothing_behind(file: Path, tmp_path: Path) -> None:
    def no_journal(about: dict[str, Any], parts: dict[str, bytes]) -> None:
        parts["runner.db"] = bytes(4096)
        about["journals"]["runner"]["sha256"] = hashlib.sha256(bytes(4096)).hexdigest()
        about["journals"]["runner"]["bytes"] = 4096

    harmful = changed(file, no_journal)
    new, used = tmp_path / "new", tmp_path / "used"
    used.mkdir()
    (used / "token").write_text("kept")
    with pytest.raises(CannotStart):
        here("restore", harmful, "--data", new)
    with pytest.raises(CannotStart):
        here("restore", harmful, "--data", used)
    assert not new.exists()
    assert [each.name for each in used.iterdir()] == ["token"], "and no lock"


def test_a_restore_takes_no_lock_away_from_a_server(file: Path, tmp_path: Path) -> None:
    (tmp_path / "new").mkdir()
    held = own(tmp_path / "new" / "runner.db")
    try:
        with pytest.raises(CannotStart, match="End action-assistant first"):
            here("restore", file, "--data", tmp_path / "new")
        assert [each.name for each in (tmp_path / "new").iterdir()] == ["runner.db.lock"]
    finally:
        os.close(held)


def test_a_link_in_it_is_not_followed(file: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in parts.items():
            entry = zipfile.ZipInfo(name)
            is_token = name == "files/token"
            entry.external_attr = ((stat.S_IFLNK if is_token else stat.S_IFREG) | 0o600) << 16
            archive.writestr(entry, content)
    with pytest.raises(CannotStart, match="files/token is no plain file"):
        here("restore", file, "--data", tmp_path / "new")


def test_a_backup_that_does_not_fit_on_the_disk_is_refused_before_anything_is_written(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=1 << 20)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(CannotStart, match=r"needs \d+ MiB, and .* has 1 MiB left"):
        here("restore", file, "--data", tmp_path / "new")


def test_an_honest_backup_of_the_highest_packing_ratio_is_restored(tmp_path: Path) -> None:
    filled(tmp_path / "old", "Ada", body=bytes(LARGE))
    assert here("backup", tmp_path / "x.zip", "--data", tmp_path / "old") == 0
    assert (tmp_path / "x.zip").stat().st_size * 100 < LARGE * 2
    assert here("restore", tmp_path / "x.zip", "--data", tmp_path / "new") == 0


def test_a_folder_of_other_things_is_left_alone(file: Path, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "thesis.tex").write_text("\\begin")
    with pytest.raises(CannotStart, match=r"holds other things \(thesis.tex\)"):
        here("restore", file, "--data", home)
    assert [path.name for path in home.iterdir()] == ["thesis.tex"]


def test_keys_of_a_folder_are_kept_and_no_link_comes_back(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = tmp_path / "new"
    filled(new, "Ben")
    (new / "revoked" / "def").touch()
    assert here("restore", file, "--data", new) == 0
    said = capsys.readouterr().out
    assert (new / "token").read_text().startswith("token of Ben")
    assert (new / "tls" / "ca.pem").read_text() == "authority of Ben"
    assert (new / "tls" / "ca-key.pem").read_text() == "key of Ben"
    assert {path.name for path in (new / "revoked").iterdir()} == {"abc", "def"}
    assert "the backup has another one: token" in said
    assert "move" in said
    (aside,) = new.glob("before-restore-*")
    assert {path.name for path in aside.iterdir()} == {"editor.db", "runner.db"}
    assert aside.stat().st_mode & 0o777 == 0o700


def test_a_backup_in_its_own_folder_does_not_hold_older_ones(data: Path) -> None:
    for name in ("monday.zip", "tuesday.zip"):
        assert here("backup", data / name, "--data", data) == 0
    assert not any("zip" in name for name in zipfile.ZipFile(data / "tuesday.zip").namelist())
    for path in data.iterdir():
        if path.suffix == ".db":
            path.unlink()
    assert here("restore", data / "tuesday.zip", "--data", data) == 0


def test_a_token_of_the_environment_is_in_the_backup(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", "given by the environment".ljust(40, "-"))
    monkeypatch.setenv("ACTION_ASSISTANT_HOSTS", "lab.test")
    assert here("backup", tmp_path / "x.zip", "--data", data) == 0
    assert here("restore", tmp_path / "x.zip", "--data", tmp_path / "new") == 0
    assert (tmp_path / "new" / "token").read_text().startswith("given by the environment")
    about = json.loads(zipfile.ZipFile(tmp_path / "x.zip").read("about.json"))
    assert about["settings"] == {"ACTION_ASSISTANT_HOSTS": "lab.test"}


# --- interrupted ------------------------------------------------------------------------------------


def contents(data: Path) -> dict[str, bytes]:
    """Files of a folder that tell of what was restored."""
    return {
        path.relative_to(data).as_posix(): path.read_bytes()
        for path in data.rglob("*")
        if path.is_file() and not path.name.startswith(".") and path.suffix != ".lock"
        if not path.relative_to(data).parts[0].startswith(("before-restore-", "."))
    }


def put(staged: Path, data: Path, file: Path, url: str, dies_at: int) -> None:
    """Put the unpacked and proven parts into place, in a process that dies at step `dies_at`."""
    steps = iter(range(1, sys.maxsize))

    def dies(before: Callable[..., Any]) -> Callable[..., Any]:
        def step(*args: Any, **kwargs: Any) -> Any:
            if next(steps) == dies_at:
                os.kill(os.getpid(), signal.SIGKILL)
            return before(*args, **kwargs)

        return step

    work = data / ".restore-x"
    shutil.copytree(staged, work)
    for owner, name in (
        (os, "fsync"),
        (os, "link"),
        (Path, "replace"),
        (Path, "unlink"),
        (Path, "mkdir"),
    ):
        setattr(owner, name, dies(getattr(owner, name)))
    about = Package(file).about
    restore._put(work, data, url, about, Progress())
    os._exit(0)


@pytest.mark.turns
@pytest.mark.parametrize("before", ["an empty folder", "a folder in use"])
def test_a_kill_at_any_step_leaves_all_as_it_was_or_whole_or_marked(
    data: Path, file: Path, tmp_path: Path, before: str
) -> None:
    staged = unpacked(file, tmp_path / "staged")
    if before == "a folder in use":
        filled(tmp_path / "used", "Ben")
    outcomes = set()
    for step in range(1, 200):
        place = tmp_path / str(step)
        if before == "a folder in use":
            shutil.copytree(tmp_path / "used", place)
        place.mkdir(exist_ok=True)
        old = contents(place)
        url = f"sqlite:///{place / 'editor.db'}"
        process = multiprocessing.get_context("fork").Process(
            target=put, args=(staged, place, file, url, step)
        )
        process.start()
        process.join(60)
        now = contents(place)
        is_marked = (place / settings.RESTORING).exists()
        is_whole = all(now.get(f"{b}.db") == (staged / f"{b}.db").read_bytes() for b in BOTH)
        if is_marked:
            with pytest.raises(CannotStart, match="interrupted"):
                settings.settled(place)
        else:
            assert is_whole or now == old
        outcomes.add("marked" if is_marked else "whole" if is_whole else "as before")
        if process.exitcode == 0:
            assert is_whole
            assert not is_marked
            break
        if step % 11 == 0:  # whatever it was, it can be done again
            assert here("restore", file, "--data", place) == 0
            settings.settled(place)
            assert not list(place.glob(".restore-*"))
        shutil.rmtree(place)
    assert outcomes == {"as before", "marked", "whole"}
    assert step > 10


BOTH: Final = ("editor", "runner")


def unpacked(file: Path, folder: Path) -> Path:
    """Return the folder that `restore` prepares before it puts anything into place."""
    folder.mkdir()
    package = Package(file)
    package.unpack(folder, Progress())
    for branch in package.about.journals:
        checked(folder / f"{branch}.db", branch, Progress(), anew=True)
    package.close()
    return folder


def test_a_restore_into_postgres_that_was_killed_goes_on_where_it_was(
    file: Path, tmp_path: Path, postgres: Server
) -> None:
    url, place = postgres.new_database(), tmp_path / "place"
    staged = unpacked(file, tmp_path / "staged")
    place.mkdir()
    for step, events in ((3, 0), (4, 0), (5, 3), (7, 3)):  # first the mark, then the graphs
        process = multiprocessing.get_context("fork").Process(
            target=put, args=(staged, place, file, url, step)
        )
        process.start()
        process.join(60)
        assert (place / settings.RESTORING).exists() == (step > 3)
        assert asyncio.run(position(url)) == events
        shutil.rmtree(place / ".restore-x")
    assert here("restore", file, "--data", place, "--database", url) == 0
    settings.settled(place)
    assert asyncio.run(position(url)) == 3  # two, and that it is another epoch
    # And not over something that is there.
    other = tmp_path / "other"
    with pytest.raises(CannotStart, match="holds events already"):
        here("restore", file, "--data", other, "--database", url)
    assert not (other / "runner.db").exists()
    settings.settled(other)


async def position(url: str) -> int:
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    try:
        assert await journal.verify() == []
        return await journal.position()
    finally:
        await journal.close()


def test_nothing_starts_in_a_folder_with_half_a_backup(data: Path) -> None:
    (data / settings.RESTORING).write_bytes(b"")
    for attempt in (
        lambda: settings.data_folder(data),
        lambda: here("backup", data.parent / "x.zip", "--data", data),
    ):
        with pytest.raises(CannotStart, match="run `action-assistant restore` again"):
            attempt()
