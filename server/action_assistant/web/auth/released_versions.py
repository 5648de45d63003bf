"""Released versions: those that an owner has released, as files that either process reads.

`released/DIGEST-VERSION.json` in the data folder stands for one version. The editor writes the files after
its log, deletes them before it, and makes them equal to its table when it starts. A runner reads them
without the editor; one with a data folder of its own is told by the page or the command. A file that is
missing or cannot be read releases nothing.
"""

import logging
import os
import re
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, Final

import msgspec

from action_assistant.errors import BadInput, Unavailable
from action_assistant.private_files import keep_damaged, read_logged, sync, write_json
from action_assistant.web.auth.keys import PersonRef

log: Final = logging.getLogger(__name__)

FOLDER: Final = "released"
_SUFFIX: Final = ".json"
_DIGEST: Final = re.compile(r"[0-9a-f]{64}")
_SETTLED_NS: Final = 3_000_000_000  # until a folder's time has changed with its next entry for sure
_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,100}")


class Release(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A released version. `digest`: of its graph together with those inside; `by`: the owner who released
    it."""

    version: Annotated[str, msgspec.Meta(max_length=100)]
    digest: Annotated[str, msgspec.Meta(max_length=64)]
    by: PersonRef
    at: datetime


class ReleasedVersions:
    """Reads and writes the files of released versions."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._by_digest: dict[str, list[Path]] = {}
        self._listed_at = 0  # when the folder had changed last, as it was listed

    def of(self, digest: str) -> Release | None:
        """Return a release of exactly the graph with this digest; None if there is none. Raise
        Unavailable if that cannot be read."""
        try:
            for path in self._of_digest(digest):
                if (found := _read(path)) is not None:
                    return found
        except OSError as error:
            raise Unavailable(
                f"Which versions are released cannot be read now: {error.strerror}."
            ) from error
        return None

    def _of_digest(self, digest: str) -> list[Path]:
        """Return the files about a digest. The folder is listed when it has changed: a start asks for
        each robot, on the event loop. A file that was deleted since is found to be gone."""
        try:
            changed = self._folder.stat().st_mtime_ns
        except FileNotFoundError:
            return []
        if changed != self._listed_at:
            now = time.time_ns()
            found: defaultdict[str, list[Path]] = defaultdict(list)
            for path in self._paths():
                found[path.name.partition("-")[0]].append(path)
            self._by_digest = dict(found)
            self._listed_at = changed if now - changed > _SETTLED_NS else 0
        return self._by_digest.get(digest, [])

    def add(self, release: Release) -> None:
        """Store a release durably; one of the same version and digest that is there stays. Raise
        BadInput for a malformed digest or id, Unavailable if it cannot be written."""
        path = self._path(release)
        try:
            if path.exists() and _read(path) is not None:
                return
            write_json(path, release)
            sync(self._folder)
        except OSError as error:
            raise Unavailable(f"The release could not be written: {error.strerror}.") from error

    def remove(self, version: str) -> None:
        """Withdraw the release of a version, durably. Raise Unavailable if that cannot be written."""
        self._delete(path for path in self._listed() if _version_of(path) == version)

    def make_equal(self, releases: Iterable[Release]) -> None:
        """Store exactly these releases, and delete all others. Raise Unavailable if that of one cannot
        be written, after all were tried."""
        wanted = {self._path(each): each for each in releases}
        unwritten: Unavailable | None = None
        try:
            self._delete(path for path in self._listed() if path not in wanted)
        except Unavailable as error:
            unwritten = error
        for release in wanted.values():
            try:
                self.add(release)
            except Unavailable as error:
                unwritten = unwritten or error
        if unwritten is not None:
            raise unwritten

    def _delete(self, paths: Iterable[Path]) -> None:
        """Delete files. Raise Unavailable if one cannot be deleted, after all were tried."""
        failed: OSError | None = None
        for path in paths:
            try:
                keep_damaged(path, Release)
                path.unlink(missing_ok=True)
            except OSError as error:
                failed = error
        try:
            if self._folder.is_dir():
                sync(self._folder)
        except OSError as error:
            failed = error
        if failed is not None:
            raise Unavailable(f"The release could not be withdrawn: {failed.strerror}.") from failed

    def _listed(self) -> list[Path]:
        try:
            return list(self._paths())
        except OSError as error:
            raise Unavailable(f"The releases cannot be read: {error.strerror}.") from error

    def _paths(self) -> Iterator[Path]:
        try:
            with os.scandir(self._folder) as entries:
                names = [entry.name for entry in entries]
                yield from [self._folder / name for name in names if name.endswith(_SUFFIX)]
        except FileNotFoundError:
            return

    def _path(self, release: Release) -> Path:
        if _DIGEST.fullmatch(release.digest) is None:
            raise BadInput("This is no digest of a graph.", where={"path": "/digest"})
        if _ID.fullmatch(release.version) is None:
            raise BadInput("This is no id of a version.", where={"path": "/version"})
        return self._folder / f"{release.digest}-{release.version}.json"


def _version_of(path: Path) -> str:
    return path.name.partition("-")[2].removesuffix(_SUFFIX)


def _read(path: Path) -> Release | None:
    """Return the release in a file; None for a file that is gone, damaged, or about another version."""
    try:
        found = read_logged(path, Release)
    except FileNotFoundError:
        return None
    is_here = found is not None and path.name == f"{found.digest}-{found.version}.json"
    return found if is_here else None
