"""Photos that people send as answers: files in a folder of the runner, one folder for each run.

A photo is stored before its answer, durably, under a name that its content gives. What it is says its
content, never its sender. When a run is over, photos that are in none of its answers are removed.
"""

import hashlib
import logging
import os
import re
from collections.abc import Awaitable, Callable, Collection
from pathlib import Path
from typing import Final

import anyio

from action_assistant.errors import BadInput, NotFound, Refused
from action_assistant.private_files import make_folder, replace_file
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.questions import LARGEST_PHOTO
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

FOLDER: Final = "photos"
#: The media types of photos, by the ending of their id.
MEDIA_TYPES: Final = {"jpg": "image/jpeg", "png": "image/png", "webp": "image/webp"}
_ID: Final = re.compile(r"[0-9a-f]{32}\.(jpg|png|webp)")
_PHOTO: Final = re.compile(r"[0-9a-f]{32}\.(?:jpg|png|webp)")
_RUN: Final = re.compile(r"[A-Za-z0-9]{1,64}")


class Photos:
    """Stores the photos of runs, and reads them. `folder`: of all; `on_disk` calls a function in a
    thread; `answers_of` returns all answers of a run, as JSON texts."""

    def __init__(
        self,
        folder: Path,
        on_disk: RunInWorker,
        answers_of: Callable[[str], Awaitable[Collection[str]]],
    ) -> None:
        self._folder = folder
        self._on_disk = on_disk
        self._answers_of = answers_of
        self._swept: set[str] = set()
        self._over: list[str] = []
        self._news = anyio.Event()

    async def store(self, run: str, content: bytes) -> str:
        """Store a photo for a run durably, and return its id. Raise BadInput if it is no JPEG, PNG or WebP
        picture, or too large; OSError if it cannot be stored."""
        ending = _kind_of(content)
        if len(content) > LARGEST_PHOTO:
            raise BadInput(f"A photo has at most {LARGEST_PHOTO // 1024 // 1024} MB.")
        photo = f"{hashlib.sha256(content).hexdigest()[:32]}.{ending}"
        await self._on_disk(_write, self._place(run), photo, content)
        return photo

    async def read(self, run: str, photo: str) -> bytes:
        """Return the content of a photo of a run. Raise NotFound if there is none with this id."""
        if not _ID.fullmatch(photo):
            raise NotFound("There is no such photo.")
        try:
            return await self._on_disk((self._place(run) / photo).read_bytes)
        except OSError:
            raise NotFound("There is no such photo.") from None

    def run_changed(self, run: Run) -> None:
        """Remove the photos that nobody has answered with, soon, if this run is over."""
        if run.led is None or run.piece is not None:
            return
        if run.end is None:
            self._swept.discard(run.id)  # it moves again
        elif run.id not in self._swept:
            self._swept.add(run.id)
            self._over.append(run.id)
            self._news.set()

    async def run(self) -> None:
        """Remove photos of runs that are over, until cancelled."""
        while True:
            while self._over:
                run = self._over.pop(0)
                if run not in self._swept:
                    continue
                try:
                    await self.sweep(run)
                except (OSError, Refused):
                    log.exception("photos of run %s that nobody answered with are left", run)
            self._news = anyio.Event()
            await self._news.wait()

    async def sweep(self, run: str) -> None:
        """Remove the photos of a run that is over, but those in its answers. Raise Unavailable if these
        cannot be read, OSError if a photo cannot be removed."""
        folder = self._place(run)
        if await self._on_disk(folder.is_dir):
            said = await self._answers_of(run)
            kept = {each for text in said for each in _PHOTO.findall(text)}
            await self._on_disk(_remove_but, folder, kept)

    def _place(self, run: str) -> Path:
        if not _RUN.fullmatch(run):
            raise NotFound("There is no such run.")
        return self._folder / run


def _remove_but(folder: Path, kept: Collection[str]) -> None:
    for path in folder.iterdir():
        if _ID.fullmatch(path.name) and path.name not in kept:
            path.unlink(missing_ok=True)
    if not any(folder.iterdir()):
        folder.rmdir()


def _write(folder: Path, photo: str, content: bytes) -> None:
    make_folder(folder)
    path = folder / photo
    if path.exists():
        return
    replace_file(path, content)
    for each in (folder, folder.parent):
        descriptor = os.open(each, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _kind_of(content: bytes) -> str:
    """Return the ending for a picture by its first bytes. Raise BadInput for other content."""
    if content.startswith(b"\xff\xd8\xff"):
        return "jpg"
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        return "png"
    if content[:4] == b"RIFF" and content[8:12] == b"WEBP":
        return "webp"
    raise BadInput("This is no JPEG, PNG or WebP picture.")
