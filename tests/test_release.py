"""`make release`, in a clone of its own: changelog, version, commit and tag, or nothing of it."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = (
    ".env.example",
    "CHANGELOG.md",
    "Dockerfile",
    "Makefile",
    "docker-compose.yml",
    "pyproject.toml",
    "ros/temoto_action_assistant/package.xml",
    "scripts/release",
)


def git(clone: Path, *arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=clone, check=True, capture_output=True, text=True
    ).stdout


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A clone of a repository that holds the present files that a release changes, and no
    others."""
    origin, found = tmp_path / "origin", tmp_path / "clone"
    for name in FILES:
        (origin / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, origin / name)
    identity = ("-c", "user.name=Ann", "-c", "user.email=ann@example.org")
    git(origin, "init", "--quiet", "--initial-branch=main")
    git(origin, "add", ".")
    git(origin, *identity, "commit", "--quiet", "--message", "begin")
    git(tmp_path, "clone", "--quiet", str(origin), str(found))
    git(found, "config", "user.name", "Ann")
    git(found, "config", "user.email", "ann@example.org")
    return found


def released(clone: Path, version: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["make", "--no-print-directory", "release", f"VERSION={version}"],
        cwd=clone,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def version_of(folder: Path) -> str:
    found: str = tomllib.loads((folder / "pyproject.toml").read_text())["tool"][
        "temoto-action-assistant"
    ]["version"]
    return found


def versions_in(folder: Path) -> set[str]:
    """Return the versions that the program and its images have."""
    texts = [
        (folder / name).read_text() for name in ("Dockerfile", "docker-compose.yml", ".env.example")
    ]
    found = {each for text in texts for each in re.findall(r"VERSION(?:=|:-)(\d[\d.dev]*)", text)}
    return {version_of(folder), *found}


def version_in_ros(folder: Path) -> list[str]:
    package = (folder / "ros" / "temoto_action_assistant" / "package.xml").read_text()
    return re.findall(r"<version>(.*)</version>", package)


def test_the_version_stands_in_one_place_and_ros_has_the_same() -> None:
    assert version_in_ros(ROOT) == [version_of(ROOT).removesuffix(".dev0")]
    assert '"version"' not in (ROOT / "frontend" / "package.json").read_text()


def test_a_release_is_one_commit_with_changelog_version_and_tag(clone: Path) -> None:
    said = (clone / "CHANGELOG.md").read_text()
    answer = released(clone, "1.2.3")
    assert answer.returncode == 0, answer.stderr
    assert git(clone, "status", "--porcelain") == ""
    subjects = git(clone, "log", "--format=%s").splitlines()
    assert subjects == ["release: begin 1.2.4", "release: 1.2.3", "begin"]
    assert git(clone, "cat-file", "-t", "v1.2.3").strip() == "tag"
    assert versions_in(clone) == {"1.2.4.dev0"}
    assert version_in_ros(clone) == ["1.2.4"]
    assert git(clone, "rev-parse", "HEAD~1") == git(clone, "rev-parse", "v1.2.3^{}")
    git(clone, "checkout", "--quiet", "v1.2.3")
    assert versions_in(clone) == {"1.2.3"}
    assert version_in_ros(clone) == ["1.2.3"]
    git(clone, "checkout", "--quiet", "main")
    now = (clone / "CHANGELOG.md").read_text()
    heading = re.search(
        r"^## Unreleased\n\n(## 1\.2\.3 - \d{4}-\d\d-\d\d)\n\n### ", now, re.MULTILINE
    )
    assert heading
    assert now.replace(f"\n{heading[1]}\n", "", 1) == said
    again = released(clone, "1.2.4")
    assert again.returncode != 0
    assert "says nothing" in again.stderr


@pytest.mark.parametrize(
    ("version", "why"),
    [("", "no version"), ("1.2", "no version"), ("v1.2.3", "no version"), ("0.0.1", "older than")],
)
def test_a_version_that_is_no_next_one_is_refused(clone: Path, version: str, why: str) -> None:
    answer = released(clone, version)
    assert answer.returncode != 0
    assert why in answer.stderr
    assert git(clone, "status", "--porcelain") == ""
    assert git(clone, "tag") == ""


def test_a_tree_that_is_not_clean_and_a_tag_that_is_there_are_refused(clone: Path) -> None:
    git(clone, "tag", "v1.2.3")
    assert "a tag v1.2.3 already" in released(clone, "1.2.3").stderr
    (clone / "new.txt").write_text("not committed")
    answer = released(clone, "1.2.4")
    assert answer.returncode != 0
    assert "not clean" in answer.stderr
    assert git(clone, "log", "--format=%s").splitlines() == ["begin"]
