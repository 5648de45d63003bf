"""Writes into a wheel which commit it was built from, as far as that is known (build_version.py).

Where nobody knows, the wheel has no commit.txt, and says so.
"""

import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NAME = "commit.txt"


class CommitHook(BuildHookInterface[Any]):
    """Called by hatchling (`tool.hatch.build.hooks.custom`)."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, but to an editable installation, where git is asked."""
        root = Path(self.root)
        says = runpy.run_path(str(root / "scripts" / "build_version.py"))
        commit = says["commit_of"](root)
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
