"""Writes into a wheel which commit it was built from, as far as that is known.

In a checkout git says it; elsewhere, as in an image that is built without .git, SOURCE_COMMIT does; a
source package carries it. Where nobody knows, the wheel has no commit.txt, and says so.
"""

import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NAME = "commit.txt"
#: What is in a wheel: anything else may change without making it another one.
SOURCES = ("server", "migrations", "frontend", "pyproject.toml")


class CommitHook(BuildHookInterface[Any]):
    """Called by hatchling (`tool.hatch.build.hooks.custom`)."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, but to an editable installation, where git is asked."""
        commit = commit_of(Path(self.root))
        if version == "editable" or commit is None:
            return
        path = Path(tempfile.mkdtemp(prefix="action-assistant-wheel-")) / NAME
        path.write_text(commit + "\n")
        path.chmod(0o644)
        place = NAME if self.target_name == "sdist" else f"action_assistant/{NAME}"
        build_data["force_include"][str(path)] = place

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Tidy up."""
        del version, artifact_path
        for name in [each for each in build_data["force_include"] if each.endswith(f"/{NAME}")]:
            Path(name).unlink(missing_ok=True)
            Path(name).parent.rmdir()


def commit_of(root: Path) -> str | None:
    """With `+` behind it when files have been changed since."""
    if (root / NAME).is_file():  # a source package
        return (root / NAME).read_text().strip()
    if not (root / ".git").exists():
        return os.environ.get("SOURCE_COMMIT", "").strip() or None
    head = _git(root, "rev-parse", "HEAD")
    if head is None:
        return None
    changed = _git(root, "status", "--porcelain", "--", *SOURCES)
    return head if changed == "" else f"{head}+"


def _git(root: Path, *arguments: str) -> str | None:
    try:
        answer = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None
