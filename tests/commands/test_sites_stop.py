"""Stop by commands with two runners: whoever may be running and got no Stop is named."""

import json
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from action_assistant.commands.stored_tokens import StoredToken, file_of
from commands.test_sites import Halls, started_at, state
from support.command_line import ran
from support.product import Product, frozen
from support.two_sites import HALL_A, HALL_B, two_sites

NOT_KNOWN = "NOT KNOWN whether there are further runners"


@pytest.fixture(scope="module")
def halls(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Halls]:
    """One server with two runners for the module."""
    with two_sites(tmp_path_factory.mktemp("halls")) as found:
        yield found


def away(product: Product, home: Path, **more: str) -> dict[str, str]:
    """The environment of a command that knows the token alone: no folder, no login, no server."""
    environ = {**product.environment, "HOME": str(home), "XDG_CONFIG_HOME": str(home / "config")}
    environ |= {"ACTION_ASSISTANT_DATA": str(home / "data"), "ACTION_ASSISTANT_URL": ""}
    return environ | more


@pytest.mark.parametrize("named", ["--port", "--url"])
def test_a_silent_editor_that_names_no_runners_leaves_a_stop_of_all_in_doubt(
    halls: Halls, tmp_path: Path, named: str
) -> None:
    product, second = halls
    where = str(product.port) if named == "--port" else product.url
    with product.runner() as first, second.client() as other:
        here, there = started_at(first, f"a{named}"), started_at(other, f"b{named}")
        with frozen(product.process("editor")):
            environ = away(product, tmp_path)
            everything = ran("stop", "--all", named, where, environ=environ)
            one = ran("stop", here, named, where, environ=environ)
            elsewhere = ran("stop", there, named, where, environ=environ)
        assert everything.returncode == 1
        assert everything.stdout == "stopped\n"
        assert NOT_KNOWN in everything.stderr
        assert product.runner_url in everything.stderr
        assert (one.returncode, one.stderr) == (0, "")  # it was there: no other runner has it
        assert elsewhere.returncode == 1
        assert NOT_KNOWN in elsewhere.stderr
        assert (state(first, here), state(other, there)) == ("stopped", "running")
        assert product.cli("stop", "--all").returncode == 0


def test_a_silent_editor_of_a_known_folder_leaves_no_runner_out(
    halls: Halls, tmp_path: Path
) -> None:
    product, second = halls
    with product.runner() as first, second.client() as other:
        runs = started_at(first, "folder a"), started_at(other, "folder b")
        with frozen(product.process("editor")):
            environ = away(product, tmp_path, ACTION_ASSISTANT_DATA=str(product.data))
            stopped = ran("stop", "--all", "--port", str(product.port), environ=environ)
        assert (stopped.returncode, stopped.stderr) == (0, "")
        assert (state(first, runs[0]), state(other, runs[1])) == ("stopped", "stopped")


def test_a_login_that_is_older_than_a_runner_does_not_call_everything_stopped(
    halls: Halls, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    product, second = halls
    environ = away(product, tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", environ["XDG_CONFIG_HOME"])
    path = file_of(product.url)
    path.parent.mkdir(parents=True)
    kept = StoredToken(product.url, "x", "old", (), 0.0, runner_url=product.runner_url)
    path.write_bytes(msgspec.json.encode(kept))
    path.chmod(0o600)
    with second.client() as other:
        there = started_at(other, "newer than the login")
        with frozen(product.process("editor")):
            stopped = ran("stop", "--all", "--url", product.url, environ=environ)
        assert stopped.returncode == 1
        assert NOT_KNOWN in stopped.stderr
        assert "the runners of the login" in stopped.stderr
        assert state(other, there) == "running"
        assert product.cli("stop", there).returncode == 0


@pytest.mark.parametrize("text", ["[{", '[{"name": "Hall A", "url": "http://127.0.0.1:x"}]'])
def test_a_damaged_list_of_runners_keeps_no_stop_from_the_known_one(
    halls: Halls, tmp_path: Path, text: str
) -> None:
    product, second = halls
    path = product.data / "runners.json"
    kept = path.read_bytes()
    with product.runner() as first, second.client() as other:
        here, there = started_at(first, f"known {text}"), started_at(other, f"unknown {text}")
        path.write_text(text)
        try:
            environ = away(product, tmp_path)
            stopped = ran("stop", "--all", "--data", str(product.data), environ=environ)
            listed = ran("runs", "--data", str(product.data), environ=environ)
        finally:
            path.write_bytes(kept)
        assert stopped.returncode == 1
        assert stopped.stdout == "stopped\n"
        assert NOT_KNOWN in stopped.stderr
        assert str(path) in stopped.stderr
        assert (state(first, here), state(other, there)) == ("stopped", "running")
        assert listed.returncode == 2
        assert str(path) in listed.stderr
        assert product.cli("stop", "--all").returncode == 0


def test_the_folder_of_a_lone_runner_says_that_it_stops_this_runner_only(
    halls: Halls, tmp_path: Path
) -> None:
    product, second = halls
    with product.runner() as first, second.client() as other:
        here, there = started_at(first, "of hall a"), started_at(other, "of hall b")
        environ = away(product, tmp_path)
        stopped = ran("stop", "--all", "--data", str(second.data), environ=environ)
        assert (stopped.returncode, stopped.stdout) == (0, "stopped\n")
        assert f"Only the runner of {second.data} was asked" in stopped.stderr
        assert (state(first, here), state(other, there)) == ("running", "stopped")
        assert ran("stop", here, "--data", str(product.data), environ=environ).stderr == ""


def test_a_serve_that_has_ended_keeps_no_stop_from_the_other_halls(
    halls: Halls, tmp_path: Path
) -> None:
    product, second = halls
    environ = away(product, tmp_path)
    data = ("--data", str(product.data))
    with second.client() as other:
        runs = [started_at(other, name) for name in ("first", "second")]
        product.end()
        try:
            one = ran("stop", runs[0], *data, environ=environ)
            assert [state(other, each) for each in runs] == ["stopped", "running"]
            everything = ran("stop", "--all", *data, environ=environ)
            nowhere = ran("stop", "no-such-run", *data, environ=environ)
            listed = ran("runs", *data, environ=environ)
            kept = json.loads((product.data / "runners.json").read_text())
            (product.data / "runners.json").write_text("[{")
            damaged = ran("stop", "--all", *data, environ=environ)
            (product.data / "runners.json").write_text(json.dumps(kept))
        finally:
            product.start()
        assert (one.returncode, one.stdout) == (0, f"{HALL_B}: stopped\n"), one.stderr
        assert (everything.returncode, everything.stdout) == (1, f"{HALL_B}: stopped\n")
        assert f"{HALL_A}: NO ANSWER TO THE STOP." in everything.stderr
        assert state(other, runs[1]) == "stopped"
        assert nowhere.returncode == 2
        assert f"{HALL_A}: NO ANSWER" in nowhere.stderr
        assert listed.returncode == 2
        assert "nothing was sent to any server" in listed.stderr
        assert damaged.returncode == 2
        assert "NOTHING WAS STOPPED" in damaged.stderr
        assert "runners.json" in damaged.stderr
