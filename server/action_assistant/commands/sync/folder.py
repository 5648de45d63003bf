"""A folder of files that people edit meanwhile: nothing of theirs is ever overwritten."""

import hashlib
import os
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.umrf.files.file_names import ENDING, graph_file_name

_STATE: Final = ".action-assistant-sync.json"
_ASIDE: Final = ".aside"


class SyncedFile(msgspec.Struct, frozen=True):
    """A file and its graph when they were last in step: the change of the graph, and the SHA-256 of the
    file, None once somebody has deleted it. `conflict`: the change of the copy that was put beside it."""

    graph: str
    seq: int
    sha: str | None
    conflict: int | None = None


class Folder:
    """The files, by name, and what is remembered of them."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.known: dict[str, SyncedFile] = self._remembered()

    def names(self) -> list[str]:
        """The files of graphs that are there."""
        found = (p.name for p in self._path.iterdir() if p.name.endswith(ENDING))
        return sorted(name for name in found if not name.startswith("."))

    def read(self, name: str) -> bytes | None:
        """What is in a file; None where there is none."""
        try:
            return (self._path / name).read_bytes()
        except FileNotFoundError:
            return None

    def has_copy(self, name: str) -> bool:
        """Whether the copy of a conflict is still there."""
        return self._copy(name).exists()

    def put_copy(self, name: str, text: bytes) -> str:
        """Put the server's text beside a file; the name of that copy."""
        self._replace(self._copy(name), text)
        return self._copy(name).name

    def remember(self, name: str, file: SyncedFile) -> None:
        """Remember that a file and its graph are in step; it survives a crash."""
        self.known[name] = file
        self._replace(self._path / _STATE, msgspec.json.format(msgspec.json.encode(self.known)))

    def free_name(self, graph_name: str) -> str:
        """A name for the file of a graph that has none."""
        number = 1
        while True:
            name = graph_file_name(graph_name, number)
            if name not in self.known and not (self._path / name).exists():
                return name
            number += 1

    def make(self, name: str, text: bytes) -> bool:
        """Make a file; False where there is one by now."""
        fresh = self._fresh(name, text)
        try:
            os.link(fresh, self._path / name)
        except FileExistsError:
            return False
        finally:
            fresh.unlink()
        return True

    def exchange(self, name: str, old: str, text: bytes) -> bool:
        """Give a file another text if it still has the one whose SHA-256 is `old`; False where somebody
        was quicker. The old file is put aside until the next round, when what somebody who had it open
        has written into it since is found."""
        aside = self._path / f".{name}.{old}{_ASIDE}"
        fresh = self._fresh(name, text)
        try:
            (self._path / name).rename(aside)
        except FileNotFoundError:
            fresh.unlink()
            return False
        was_same = sha(aside.read_bytes()) == old
        try:
            os.link(fresh if was_same else aside, self._path / name)
        except FileExistsError:  # somebody has just written it anew
            was_same = False
        fresh.unlink()
        return was_same

    def late_writings(self) -> dict[str, str]:
        """Texts that somebody wrote into a file before or after it was put aside, kept under names of
        their own: those, by the name of the file. To be asked at the beginning of a round."""
        found: dict[str, str] = {}
        for aside in sorted(self._path.glob(f".*{ENDING}.*{_ASIDE}")):
            name, _, old = aside.name[1:].removesuffix(_ASIDE).rpartition(".")
            text = aside.read_bytes()
            if sha(text) == old or text == self.read(name):
                aside.unlink()
                continue
            kept = self._path / f"{name}.mine-{sha(text)[:8]}"
            aside.replace(kept)
            found[name] = kept.name
        return found

    def _fresh(self, name: str, text: bytes) -> Path:
        fresh = self._path / f".{name}.new"
        with fresh.open("wb") as out:
            out.write(text)
            out.flush()
            os.fsync(out.fileno())
        return fresh

    def _replace(self, path: Path, text: bytes) -> None:
        self._fresh(path.name, text).replace(path)

    def _copy(self, name: str) -> Path:
        return self._path / f"{name}.server"

    def _remembered(self) -> dict[str, SyncedFile]:
        path = self._path / _STATE
        try:
            return msgspec.json.decode(path.read_bytes(), type=dict[str, SyncedFile])
        except FileNotFoundError:
            return {}
        except (OSError, msgspec.DecodeError) as error:
            raise CannotStart(f"Cannot read {path}: {error}.") from error


def sha(text: bytes) -> str:
    """The SHA-256 of a text, in hex."""
    return hashlib.sha256(text).hexdigest()
