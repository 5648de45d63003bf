"""An action to make packages of, and what lies in a folder."""

from pathlib import Path
from typing import Any, Final

ONE: Final[dict[str, Any]] = {
    "name": "OpenGripper",
    "type": "sync",
    "input_parameters": {"width": {"pvf_type": "number"}},
}


def everything(folder: Path) -> dict[str, bytes]:
    """Contents of all files below, by path."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
    }
