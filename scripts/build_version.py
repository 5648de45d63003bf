#!/usr/bin/env python3
"""Says which version is built here: `0.2.0.dev1234+g1a2b3c4d`, or `1.2.3` from the commit of a release.

The base stands in pyproject.toml. While it ends with `.dev0`, the number of commits takes the place of
the 0, and the commit follows, with `.changed` if files were changed since. Git says both in a checkout;
elsewhere a source package does (PKG-INFO), or SOURCE_VERSION and SOURCE_COMMIT, as in an image that is
built without .git. Where nobody knows, and in a clone without its history, the 0 stays.

Usage: build_version.py [env]. With `env` it prints lines for .env: the tag of images, and the commit.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: What is in a wheel: anything else may change without making it another one.
SOURCES = ("server", "migrations", "frontend", "pyproject.toml")
_BASE = re.compile(r'^version = "(\d+\.\d+\.\d+(?:\.dev0)?)"$', re.MULTILINE)
_GIVEN = re.compile(r"\d+\.\d+\.\d+(?:\.dev\d+)?(?:[+-]g[0-9a-f]+(?:\.changed)?)?")
_SHORT = 8


def base_of(root: Path) -> str:
    """Return the version as pyproject.toml has it."""
    found = _BASE.search((root / "pyproject.toml").read_text())
    if found is None:
        raise SystemExit("pyproject.toml says no version of the form 1.2.3 or 1.2.3.dev0.")
    return found[1]


def version_of(root: Path = ROOT) -> str:
    """Return the version that is built from the sources in the folder `root`."""
    base = base_of(root)
    if (root / "PKG-INFO").is_file():
        found = re.search(r"^Version: (.+)$", (root / "PKG-INFO").read_text(), re.MULTILINE)
        return found[1] if found else base
    if not (root / ".git").exists():
        given = os.environ.get("SOURCE_VERSION", "").strip() or base
        if not _GIVEN.fullmatch(given):
            raise SystemExit(
                f"SOURCE_VERSION is {given!r}, and not of the form 1.2.3.dev4-g1a2b3c4d."
            )
        return given.replace("-", "+")
    commit = commit_of(root)
    if not base.endswith(".dev0") or commit is None:
        return base
    is_whole = git(root, "rev-parse", "--is-shallow-repository") == "false"
    count = git(root, "rev-list", "--count", "HEAD") if is_whole else "0"
    changed = ".changed" if commit.endswith("+") else ""
    return f"{base.removesuffix('0')}{count or 0}+g{commit[:_SHORT]}{changed}"


def commit_of(root: Path = ROOT) -> str | None:
    """Return the commit of the sources, with `+` behind it when files have been changed since; None
    if nobody knows it."""
    if (root / "commit.txt").is_file():  # a source package
        return (root / "commit.txt").read_text().strip()
    if not (root / ".git").exists():
        return os.environ.get("SOURCE_COMMIT", "").strip() or None
    head = git(root, "rev-parse", "HEAD")
    if head is None:
        return None
    changed = git(root, "status", "--porcelain", "--", *SOURCES)
    return head if changed == "" else f"{head}+"


def git(root: Path, *arguments: str) -> str | None:
    """Return the answer of git; None if it fails."""
    try:
        answer = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None


if __name__ == "__main__":
    told = version_of()
    if sys.argv[1:] == ["env"]:
        told = f"IMAGE_VERSION={told.replace('+', '-')}\nSOURCE_COMMIT={commit_of() or ''}"
    sys.stdout.write(told + "\n")
