"""Recordings of the real engine and of its node: where they are, and how they are packed.

`$UMRF_RECORDINGS` is a folder with `engine/`, `node/` or both (default: `tests/recordings`, whose
README says what is in them). Files may lie there as they are, or in `*.tar.xz`.

    PYTHONPATH=tests .venv/bin/python -m support.recordings pack ARCHIVE FILE…

adds files to an archive (made if it is not there), by their paths from the folder that one stands in.
"""

import atexit
import io
import json
import lzma
import os
import shutil
import sys
import tarfile
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

OWN = Path(__file__).parents[1] / "recordings"
#: Recordings that are larger, or not ours to publish: real files of other projects, and runs of
#: their graphs.
SHARED = Path(os.environ.get("UMRF_SHARED", Path(__file__).parents[3] / "shared"))
CORPUS = SHARED / "umrf" / "corpus"
NO_CORPUS = "real files of other repositories are not here (UMRF_SHARED)"
NAMED = os.environ.get("UMRF_RECORDINGS")
#: The least number of calls for which an action has a behaviour; later calls repeat the last one.
CALLS = 5
KINDS: dict[type, Any] = {int: (int, float), float: (int, float), str: str}


@cache
def family(name: str) -> Path:
    """The folder `engine` or `node`, with all that was packed; it may not exist."""
    return unpacked((Path(NAMED).resolve() if NAMED else OWN) / name)


def unpacked(folder: Path) -> Path:
    """A folder in which nothing is packed; one that lasts as long as this process if need be."""
    archives = sorted(folder.glob("*.tar.xz"))
    if not archives:
        return folder
    there = Path(tempfile.mkdtemp(prefix="action-assistant-recordings-"))
    atexit.register(shutil.rmtree, there, ignore_errors=True)
    shutil.copytree(folder, there, ignore=shutil.ignore_patterns("*.tar.xz"), dirs_exist_ok=True)
    for archive in archives:
        with tarfile.open(archive) as tar:
            tar.extractall(there, filter="data")
    return there


@cache
def facts(name: str) -> dict[str, Any]:
    """Return the facts of a folder about its recordings, and their actions."""
    path = family(name) / "facts.json"
    found: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return found


def calls_of(name: str, action: str, inputs: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the behaviour of an action in each of its calls, from the folder's facts and its
    inputs."""
    known = facts(name)["actions"]
    does = {field: _given(value, inputs) for field, value in known.get(action, known["*"]).items()}
    if times := does.pop("times", 0):
        results = ["on_true"] * (int(times) - 1) + ["on_false"]
    else:
        results = list(does.pop("results", [does.get("result", "on_true")]))
    message = does.pop("message", None)
    results += results[-1:] * (CALLS - len(results))
    return [
        does | {"result": result} | ({"message": message.format(n=n)} if message else {})
        for n, result in enumerate(results, 1)
    ]


def _given(value: Any, inputs: Mapping[str, Any]) -> Any:
    """A value of the facts; `{"input": NAME}` stands for an input of the action."""
    match value:
        case {"input": name}:
            found, otherwise = inputs.get(name), value.get("else")
            if "else" in value and not isinstance(found, KINDS[type(otherwise)]):
                found = otherwise
            return found + value["plus"] if "plus" in value else found
        case dict():
            members = {key: _given(each, inputs) for key, each in value.items()}
            return {key: each for key, each in members.items() if each} or None
        case _:
            return value


def engine_runs() -> dict[str, Path]:
    """Recorded runs of the engine by name, with their folder.

    Where nobody named a folder, also those of graphs that belong to the engine's own repository.
    """
    folders = [family("engine"), *([] if NAMED else [SHARED / "umrf" / "traces"])]
    found: dict[str, Path] = {}
    for folder in folders:
        for path in sorted(folder.glob("*.graph.json")):
            name = path.name.removesuffix(".graph.json")
            if (folder / f"{name}.trace.jsonl").exists():
                found.setdefault(name, folder)
    return dict(sorted(found.items()))


def runs_of(folder: Path, name: str) -> list[list[dict[str, Any]]]:
    """Return the events of each recorded run; of an engine with the bypass repaired where there
    are such."""
    repaired = sorted((folder / "bypass_fixed").glob(f"{name}.trace*.jsonl"))
    paths = repaired or sorted(folder.glob(f"{name}.trace*.jsonl"))
    return [lines(path) for path in paths]


def lines(path: Path) -> list[dict[str, Any]]:
    """One value per line; nothing where there is no such file."""
    text = path.read_text() if path.exists() else ""
    return [json.loads(line) for line in text.splitlines() if line]


def pack(archive: Path, files: list[Path]) -> None:
    """Pack files so that the same files always make the same bytes."""
    contents: dict[str, bytes] = {}
    if archive.exists():
        with tarfile.open(archive) as tar:
            for member in tar:
                inside = tar.extractfile(member)
                contents |= {member.name: inside.read()} if inside else {}
    contents |= {path.as_posix(): path.read_bytes() for path in files}
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name, content in sorted(contents.items()):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            tar.addfile(member, io.BytesIO(content))
    archive.write_bytes(lzma.compress(packed.getvalue(), preset=9 | lzma.PRESET_EXTREME))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["pack", archive, *files] if files:
            pack(Path(archive), [Path(file) for file in files])
        case _:
            sys.exit(__doc__)
