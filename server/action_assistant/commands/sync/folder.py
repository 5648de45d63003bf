"""The folder of `sync`: people edit its files meanwhile, and nothing of theirs is overwritten or deleted.

A file gets another text in steps, and a process may end between any two of them. The state says before
the first step what is coming, so that the next round can finish it or take it back (docs/decisions/066).
"""

import hashlib
import itertools
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final

import msgspec
from msgspec.structs import replace

from action_assistant.commands.directories import Directory, Owner, is_component, opened, why
from action_assistant.errors import CannotStart
from action_assistant.umrf.files.writing import ENDING, graph_file_name

_STATE: Final = ".action-assistant-sync.json"
_FRESH: Final = re.compile(r"\.action-assistant-sync-([0-9a-f]{16})\.new")
_ASIDE: Final = re.compile(r"\.action-assistant-sync-([0-9a-f]{16})\.aside")
#: The names of files put aside by versions up to November 2026.
_FORMER_ASIDE: Final = re.compile(rf"\.(.+{re.escape(ENDING)})\.([0-9a-f]{{64}})\.aside", re.DOTALL)

_Sha = Annotated[str, msgspec.Meta(pattern=r"\A[0-9a-f]{64}\Z")]
_Token = Annotated[str, msgspec.Meta(pattern=r"\A[0-9a-f]{16}\Z")]
_Seq = Annotated[int, msgspec.Meta(ge=0)]


class PutAside(msgspec.Struct, frozen=True):
    """A replaced file, kept until the next round under a name with this token. `sha`: the SHA-256
    of its content at that time."""

    token: _Token
    sha: _Sha


class Coming(msgspec.Struct, frozen=True):
    """The text that a file is about to hold: that of the graph at the change `seq`."""

    token: _Token
    seq: _Seq
    sha: _Sha


class SyncedFile(msgspec.Struct, frozen=True):
    """A file and its graph when they were last in sync: the change of the graph, and the SHA-256 of
    the file, None once the file was deleted. `graph`: "" while the graph of a new file is being
    made. `conflict`: the change of the copy that was put beside the file; `copy`: the number of
    that copy."""

    graph: Annotated[str, msgspec.Meta(pattern=r"\A[A-Za-z0-9_-]*\Z")]
    seq: _Seq
    sha: _Sha | None
    conflict: _Seq | None = None
    copy: Annotated[int, msgspec.Meta(ge=1)] = 1
    aside: PutAside | None = None
    coming: Coming | None = None


class FolderTrouble(msgspec.Struct, frozen=True):
    """A problem of the folder, in words. `name`: the file that this round skips because of it, ""
    for none. `is_open`: a person has to resolve it."""

    text: str
    name: str = ""
    is_open: bool = True


class Folder:
    """The files of a folder by name, and the stored state of their synchronisation. The constructor
    raises CannotStart if folder or state cannot be read; the methods raise OSError."""

    def __init__(self, path: Path) -> None:
        try:
            self._at: Directory = opened(path)
        except OSError as error:
            raise CannotStart(f"Cannot read the folder {path}: {why(error)}.") from error
        self._trouble: list[FolderTrouble] = []
        self._unread: dict[str, msgspec.Raw] = {}
        self.known: dict[str, SyncedFile] = self._remembered(path / _STATE)

    def close(self) -> None:
        """Close the descriptor of the open folder."""
        self._at.close()

    def names(self) -> list[str]:
        """Return the names of everything that is called like the file of a graph."""
        return sorted(n for n in self._at.names() if _is_graph_file(n) and _is_utf8(n))

    def read(self, name: str) -> bytes | None:
        """Return the content of the file `name`; None if there is no such entry. Raise OSError if
        the entry is no regular file."""
        try:
            return self._at.read(name)[0]
        except FileNotFoundError:
            return None

    def copy_of(self, name: str, file: SyncedFile) -> str | None:
        """Return the name of the copy that was put beside a file for a conflict, None once it is
        gone. `file`: the stored state of the file."""
        copy = _copy(name, file.copy)
        return copy if self._is_there(copy) else None

    def put_copy(self, name: str, text: bytes) -> int:
        """Write the server's text as a new copy beside the file `name`, replacing nothing; return
        the number of that copy."""
        rights = _rights(self._at.status(name))
        fresh = _fresh(secrets.token_hex(8))
        self._at.write_new(fresh, text, *rights)
        number = 1
        while not self._move(fresh, _copy(name, number)):
            there = self._read_or_none(_copy(name, number))
            if there is not None and text.startswith(there):  # left by a round that was interrupted
                self._at.complete(_copy(name, number), text, *rights)
                break
            number += 1
        self._at.remove(fresh)
        return number

    def remember(self, name: str, file: SyncedFile) -> None:
        """Store durably the state in which the file `name` and its graph are in sync."""
        self._store({**self.known, name: file})

    def forget(self, name: str) -> None:
        """Store durably that the file `name` has no graph."""
        self._store({each: file for each, file in self.known.items() if each != name})

    def free_name(self, graph_name: str) -> str:
        """Return a name for the file of a graph that has none."""
        number = 1
        while True:
            name = graph_file_name(graph_name, number)
            if name not in {*self.known, *self._unread} and not self._is_there(name):
                return name
            number += 1

    def make(self, name: str, graph: str, seq: int, text: bytes) -> bool:
        """Create the file `name` with `text`, that of a graph (its id) after its change `seq`;
        return False if the name is taken by now."""
        coming = Coming(secrets.token_hex(8), seq, sha(text))
        self.remember(name, SyncedFile(graph, seq, None, coming=coming))
        self._at.write_new(_fresh(coming.token), text, None)
        made = self._move(_fresh(coming.token), name)
        if made:
            self.remember(name, SyncedFile(graph, seq, coming.sha))
        else:
            self.forget(name)
        self._at.remove(_fresh(coming.token))
        return made

    def exchange(self, name: str, old: str, seq: int, text: bytes) -> bool:
        """Replace the text of a file by `text`, that of its graph at `seq`, if the file still has
        the SHA-256 `old`; return False if it was changed meanwhile. The old file stays under
        another name until the next round, which finds what an editor that had it open has written
        since."""
        before = self.known[name]
        coming = Coming(secrets.token_hex(8), seq, sha(text))
        aside = PutAside(coming.token, old)
        mode, owner = _rights(self._at.status(name))
        self.remember(name, replace(before, aside=aside, coming=coming))
        self._at.write_new(_fresh(coming.token), text, mode, owner)
        try:
            self._at.replace(name, _aside(aside))
        except FileNotFoundError:
            exchanged = False
        else:
            moved = self._read_or_none(_aside(aside))
            is_same = moved is not None and sha(moved) == old
            exchanged = (
                self._move(_fresh(coming.token) if is_same else _aside(aside), name) and is_same
            )
        if exchanged:
            self.remember(name, SyncedFile(before.graph, seq, coming.sha, aside=aside))
        else:
            self.remember(name, replace(before, aside=aside))
        self._at.remove(_fresh(coming.token))
        return exchanged

    def recover(self) -> list[FolderTrouble]:
        """Complete or undo what an interrupted round has begun, and keep under new names what
        people have written meanwhile. Call it at the start of a round; return what to report."""
        known = dict(self.known)
        for name, file in self.known.items():
            try:
                resumed = self._resumed(name, file)
                if resumed is None:
                    del known[name]
                    continue
                if resumed.aside is not None:
                    self._look_after(name, _aside(resumed.aside), resumed.aside.sha)
                known[name] = replace(resumed, aside=None)
            except OSError as error:
                self._trouble.append(FolderTrouble(f"{name}: {why(error)}", name))
        if known != self.known:
            self._store(known)
        self._clear_up()
        return self._trouble

    def _resumed(self, name: str, file: SyncedFile) -> SyncedFile | None:
        """Complete or undo an exchange of the file `name` that was interrupted, and return its
        state without the pending part. Return None if it was a new file that was never created.
        Raise OSError if a file cannot be read or moved."""
        coming = file.coming
        if coming is None:
            return file
        aside = None if file.aside is None else _aside(file.aside)
        here = self.read(name)
        was_moved = aside is not None and self._is_there(aside)
        if here is None and aside is not None and was_moved:
            self._move(aside, name)
            here = self.read(name)
        elif here is not None and (aside is None or was_moved):
            here = self._completed(name, here, [_fresh(coming.token), aside])
        if here is not None and sha(here) == coming.sha:
            return SyncedFile(file.graph, coming.seq, coming.sha, aside=file.aside)
        # A new file has no state to go back to: whatever has its name by now is somebody's own.
        return None if file.sha is None and file.aside is None else replace(file, coming=None)

    def _completed(self, name: str, here: bytes, sources: list[str | None]) -> bytes:
        """Complete the file `name`, with the content `here`, if only the beginning of one of
        `sources` was written when the process ended (without hard links files are copied). Return
        the content."""
        for source in filter(None, sources):
            text = self.read(source)
            if text is not None and len(here) < len(text) and text.startswith(here):
                self._at.complete(name, text, *_rights(self._at.status(source)))
                return text
        return here

    def _look_after(
        self, name: str, aside: str, old: str, what: str = "was written while it was exchanged"
    ) -> None:
        """Remove the file `aside`, which was moved aside from `name` with the SHA-256 `old`; if it
        was written into since, keep it under another name and report that (`what`). Raise OSError
        if that fails."""
        text = self.read(aside)
        if text is None:
            return
        if sha(text) != old and text != self._read_or_none(name):
            kept = self._kept(name, aside, text)
            self._trouble.append(
                FolderTrouble(f"{name}: {what}; that text is in {kept}", is_open=False)
            )
        self._at.remove(aside)

    def _kept(self, name: str, aside: str, text: bytes) -> str:
        """Rename the file `aside`, with this text, to an unused name beside `name`, and return
        that."""
        names = (f"{name}.mine-{sha(text)[:8]}{more}" for more in _numbers())
        return next(
            kept for kept in names if self._move(aside, kept) or self._read_or_none(kept) == text
        )

    def _clear_up(self) -> None:
        """Remove files that interrupted rounds have left, and report unknown ones."""
        kept = {_aside(file.aside) for file in self.known.values() if file.aside is not None}
        coming = {
            _fresh(file.coming.token) for file in self.known.values() if file.coming is not None
        }
        for entry in sorted(self._at.names()):
            try:
                if _FRESH.fullmatch(entry) and entry not in coming:
                    self._at.remove(entry)
                elif _ASIDE.fullmatch(entry) and entry not in kept:
                    self._trouble.append(
                        FolderTrouble(
                            f"{entry}: was put aside, and its file is not known; it stays"
                        )
                    )
                elif _is_graph_file(entry) and not _is_utf8(entry):
                    self._trouble.append(FolderTrouble(f"{entry}: its name is not UTF-8", entry))
                elif former := _FORMER_ASIDE.fullmatch(entry):
                    self._look_after_former(entry, former[1], former[2])
            except OSError as error:
                self._trouble.append(FolderTrouble(f"{entry}: {why(error)}"))

    def _look_after_former(self, aside: str, name: str, old: str) -> None:
        """Handle a file that an earlier version of this program has moved aside from `name`, as
        `_look_after` does."""
        file = self.known.get(name)
        if not self._is_there(name):
            if file is not None and file.sha == old:
                self._move(aside, name)
            else:
                self._look_after(name, aside, "", "is gone, and an older text of it was put aside")
                return
        self._look_after(name, aside, old)

    def _read_or_none(self, name: str) -> bytes | None:
        """Return the content of the file `name`; None if it does not exist or is no regular file."""
        try:
            return self.read(name)
        except OSError:
            return None

    def _is_there(self, name: str) -> bool:
        """Return whether an entry has this name, even if it is a link that leads nowhere."""
        try:
            self._at.status(name)
        except FileNotFoundError:
            return False
        return True

    def _move(self, old: str, new: str) -> bool:
        """Rename the file `old` to `new` without overwriting; return False if `new` exists. Without
        hard links a regular file is copied, since a rename could overwrite."""
        try:
            self._at.link(old, new)
        except FileExistsError:
            return False
        except OSError:
            found = self._at.status(old)
            if not stat.S_ISREG(found.st_mode):
                if self._is_there(new):
                    return False
                self._at.replace(old, new)
                return True
            try:
                self._at.write_new(new, self._at.read(old)[0], *_rights(found))
            except FileExistsError:
                return False
        return True

    def _store(self, known: dict[str, SyncedFile]) -> None:
        """Replace the stored state of the folder by `known`, durably. Raise OSError if it cannot be
        written."""
        fresh = _fresh(secrets.token_hex(8))
        rights: tuple[int, Owner] | tuple[None, None] = (None, None)
        with suppress(FileNotFoundError):
            rights = _rights(self._at.status(_STATE))
        text = msgspec.json.format(msgspec.json.encode({**self._unread, **known}))
        self._at.write_new(fresh, text, *rights)
        self._at.replace(fresh, _STATE)
        self.known = known

    def _remembered(self, path: Path) -> dict[str, SyncedFile]:
        """Return the entries of the stored state. An entry that is malformed or names no file of
        this folder is reported and not used, but stays stored. `path`: the path of the state, for
        messages. Raise CannotStart if the state cannot be read."""
        try:
            text = self.read(_STATE)
            entries = {} if text is None else msgspec.json.decode(text, type=dict[str, msgspec.Raw])
        except (OSError, ValueError, RecursionError) as error:
            reason = why(error) if isinstance(error, OSError) else str(error)
            raise CannotStart(f"Cannot read {path}: {reason}.") from error
        known: dict[str, SyncedFile] = {}
        for name, entry in entries.items():
            try:
                if not _is_graph_file(name):
                    raise msgspec.ValidationError("that is no file of a graph in this folder")
                known[name] = msgspec.json.decode(entry, type=SyncedFile)
            except (ValueError, RecursionError) as error:
                self._unread[name] = msgspec.Raw(entry)
                told = f"{name}: its entry in {_STATE} is not used: {error}"
                self._trouble.append(FolderTrouble(told, name))
        return known


def sha(text: bytes) -> str:
    """Return the SHA-256 of the bytes `text`, in hex."""
    return hashlib.sha256(text).hexdigest()


def _is_graph_file(name: str) -> bool:
    return name.endswith(ENDING) and not name.startswith(".") and is_component(name)


def _is_utf8(name: str) -> bool:
    """Return whether a name can be written into the state."""
    return not any("\ud800" <= character <= "\udfff" for character in name)


def _fresh(token: str) -> str:
    return f".action-assistant-sync-{token}.new"


def _aside(aside: PutAside) -> str:
    return f".action-assistant-sync-{aside.token}.aside"


def _copy(name: str, number: int) -> str:
    return f"{name}.server{'' if number == 1 else f'-{number}'}"


def _numbers() -> Iterator[str]:
    """Yield endings that make names unique, the first of them empty."""
    yield ""
    yield from (f"-{number}" for number in itertools.count(2))


def _rights(found: os.stat_result) -> tuple[int, Owner]:
    """Return the permissions and the owner in the status of an entry."""
    return stat.S_IMODE(found.st_mode), Owner(found.st_uid, found.st_gid)
