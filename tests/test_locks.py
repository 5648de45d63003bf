"""Every environment installs what the package asks for."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def pinned(lock: str) -> dict[str, set[str]]:
    """Versions by package."""
    found: dict[str, set[str]] = {}
    text = (ROOT / "requirements" / lock).read_text()
    for name, version in re.findall(r"^([a-z0-9-]+)(?:\[[^\]]*\])?==([^\s;]+)", text, re.MULTILINE):
        found.setdefault(name, set()).add(version)
    return found


def asked() -> set[str]:
    """Names of the packages that pyproject.toml asks for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return {re.split(r"[\s\[<>=;~!]", each)[0].lower() for each in project["dependencies"]}


@pytest.mark.parametrize("lock", ["dev.txt", "ros.txt", "run.txt"])
def test_every_package_that_is_asked_for_is_locked(lock: str) -> None:
    missing = asked() - pinned(lock).keys()
    assert not missing, f"`make lock` renews requirements/{lock}"


@pytest.mark.parametrize("lock", ["ros.txt", "run.txt", "build.txt", "site.txt"])
def test_every_environment_has_the_versions_that_are_tested(lock: str) -> None:
    tested, other = pinned("dev.txt"), pinned(lock)
    different = {name for name in tested.keys() & other.keys() if tested[name] != other[name]}
    assert not different, "`make lock` renews them all"


@pytest.mark.parametrize("lock", ["dev.txt", "ros.txt", "run.txt", "build.txt", "site.txt"])
def test_a_lock_names_no_machine_and_hashes_everything(lock: str) -> None:
    text = (ROOT / "requirements" / lock).read_text()
    assert "://" not in text
    entries = text.replace("\\\n", " ").splitlines()
    assert all("--hash=sha256:" in each for each in entries if each and not each.startswith("#"))
