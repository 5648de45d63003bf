"""Images of an earlier commit, those of this one, and back, by the commands of docs/containers.md."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from containers.engine import inspect, run
from containers.images import VERSION, earlier_version
from containers.stack import Stack, running

PAGE = "http://127.0.0.1:8000"
SERVICES = ("editor", "runner")


@pytest.fixture(scope="module")
def earlier() -> str:
    """The tag of the images of the earlier commit."""
    return earlier_version()


@pytest.fixture
def stack(earlier: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stack]:
    """The earlier images with Postgres, without a setting of the shell's."""
    monkeypatch.delenv("IMAGE_VERSION")
    with running(
        "upgrade", "db", *SERVICES, settings={"IMAGE_VERSION": earlier, "SOURCE_COMMIT": ""}
    ) as found:
        yield found


def tag(stack: Stack, version: str) -> None:
    """Name the images in .env, as `make images` does and as people do for the way back."""
    (stack.folder / ".env").write_text(f"IMAGE_VERSION={version}\nSOURCE_COMMIT=\n")


def at_once(stack: Stack, *words: str) -> "subprocess.CompletedProcess[str]":
    """`docker compose run --rm editor …`, whatever it answers."""
    return stack.compose("run", "--rm", "-T", "editor", *words, check=False)


def test_an_upgrade_keeps_what_is_stored_and_the_way_back_has_a_name(
    stack: Stack, earlier: str, tmp_path: Path
) -> None:
    assert serves() == earlier
    made = stack.said("editor", "graphs")
    (link, *_) = stack.said("editor", "people", "invite", "editor", "--label", "Mari").split()
    assert stack.said("editor", "run", "morning_round").endswith("finished (on_true)\n")

    tag(stack, VERSION)
    stack.said("editor", "backup", "/data/before.zip")
    looked = at_once(stack, "doctor", "--before-upgrade")
    assert looked.returncode == 0, looked.stdout + looked.stderr
    assert "the next start changes them to editor_" in looked.stdout
    assert serves() == earlier, "looking changes nothing"
    stack.up(*SERVICES)
    assert serves() == VERSION
    assert stack.said("editor", "graphs") == made
    assert link in stack.said("editor", "people", "list")
    assert "morning_round" in stack.said("editor", "runs")
    later = tmp_path / "later.json"
    later.write_text('{"graph_name": "later"}')
    run("podman", "cp", later, f"{stack.container('editor')}:/tmp/later.json")
    stack.said("editor", "import", "/tmp/later.json")
    assert "later" in stack.said("editor", "graphs")

    stack.compose("stop", *SERVICES)
    listed = at_once(stack, "migrate", "--back")
    copies = [word for word in listed.stdout.split() if word.startswith("/data/before-upgrade/")]
    assert copies, listed.stdout + listed.stderr
    back = at_once(stack, "migrate", "--back", *copies)
    assert back.returncode == 0, back.stdout + back.stderr
    tag(stack, earlier)
    stack.up(*SERVICES)
    assert serves() == earlier
    assert stack.said("editor", "graphs") == made
    assert link in stack.said("editor", "people", "list")
    assert "morning_round" in stack.said("editor", "runs")
    for service in SERVICES:
        labels = inspect(f"temoto-action-assistant/{service}:{earlier}")["Labels"]
        assert labels["org.opencontainers.image.version"] == earlier


def serves() -> str:
    """Return the tag of the version that answers at the page's port."""
    answer = httpx.get(f"{PAGE}/healthz", trust_env=False, timeout=30).json()
    return str(answer["version"]).replace("+", "-")
