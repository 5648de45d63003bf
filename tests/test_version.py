"""The command line and both processes say which version and commit they are, and never guess."""

import subprocess
import tomllib
from pathlib import Path

import httpx
import pytest

from action_assistant import paths, version
from support.product import COMMAND, running

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _asked_anew() -> None:
    version.commit.cache_clear()


def head() -> str:
    asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()


def test_the_version_is_that_of_the_project() -> None:
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    assert tools["temoto-action-assistant"]["version"] == version.VERSION


def test_a_checkout_says_its_commit_and_that_it_is_one() -> None:
    shown = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    number = version.VERSION
    assert shown.stdout == f"action-assistant {number} (commit {head()[:8]}, a checkout)\n"


@pytest.mark.parametrize(
    ("carried", "said"),
    [("1a2b3c4d5e6f", "commit 1a2b3c4d"), ("1a2b3c4d5e6f+", "commit 1a2b3c4d+")],
)
def test_a_wheel_says_what_it_was_built_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, carried: str, said: str
) -> None:
    (tmp_path / "commit.txt").write_text(f"{carried}\n")
    monkeypatch.setattr(version, "_CARRIED", tmp_path / "commit.txt")
    assert version.commit() == carried
    assert version.described() == f"{version.VERSION} ({said})"


def test_an_unknown_commit_is_reported_as_not_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sources may also lie in the repository of another project."""
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    (tmp_path / "inner" / ".git").mkdir(parents=True)
    for folder in (None, tmp_path, tmp_path / "inner"):
        monkeypatch.setattr(paths, "checkout", lambda folder=folder: folder)
        version.commit.cache_clear()
        assert version.commit() is None
        assert version.described() == f"{version.VERSION} (commit not known)"


def test_both_processes_report_version_and_commit(tmp_path: Path) -> None:
    with running(tmp_path / "data") as product, product.editor() as editor:
        known = {"version": version.VERSION, "commit": head()}
        assert known.items() <= editor.get("/api/config").json().items()
        for url in (product.url, product.runner_url):
            said = httpx.get(f"{url}/healthz", trust_env=False).json()
            assert said == {"status": "ok", **known}
