"""Identity of this program: its version, and the commit that it comes from as far as that is known.

Each wheel has a version of its own, and carries the commit that it was built from
(scripts/build_version.py). A checkout has the version of pyproject.toml, the same for all commits until
the next release, and git is asked for the commit. Neither is guessed.
"""

import re
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from action_assistant import paths

_CARRIED: Final = Path(__file__).with_name("commit.txt")
_PATIENCE: Final = 2.0  # seconds for git
_SHORT: Final = 8


def _version() -> str:
    """Return the version of a checkout, which may have moved on since it was installed, or of an
    installed package."""
    folder = paths.checkout()
    if folder is not None:
        text = (folder / "pyproject.toml").read_text()
        if found := re.search(r'^version = "(.+)"$', text, re.MULTILINE):
            return found[1]
    try:
        return version("temoto-action-assistant")
    except PackageNotFoundError:  # run from a folder that was never installed
        return "0.0.0"


VERSION: Final = _version()


@cache
def commit() -> str | None:
    """Return the commit of this program as 40 hex digits, or None. A `+` follows if the wheel was
    built from files with changes that were not committed."""
    try:
        return _CARRIED.read_text().strip() or None
    except OSError:
        return _checked_out()


def described() -> str:
    """Return the version for people, for example `0.2.0.dev1234+g1a2b3c4d (commit 1a2b3c4d)`. The text also says if
    the program runs from a checkout, where files may have changed since the commit."""
    known = commit()
    if known is None:
        return f"{VERSION} (commit not known)"
    short = known[:_SHORT] + "+" * known.endswith("+")
    return f"{VERSION} (commit {short}{'' if _CARRIED.exists() else ', a checkout'})"


def _checked_out() -> str | None:
    """Return the commit of the checkout that this code runs from, or None.

    Return None for a copy that lies inside another repository.
    """
    folder = paths.checkout()
    if folder is None or not (folder / ".git").exists():
        return None
    try:
        asked = subprocess.run(
            ["git", "-C", str(folder), "rev-parse", "--show-toplevel", "HEAD"],
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            stdin=subprocess.DEVNULL,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    said = asked.stdout.split("\n")
    if asked.returncode or Path(said[0]).resolve() != folder.resolve():
        return None
    return said[1]
