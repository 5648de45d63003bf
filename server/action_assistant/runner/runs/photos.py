"""Photos that people send as answers: files in a folder of the runner, one folder for each run.

A photo is stored before its answer, durably, under a name that its content gives. What it is says its
content, never its sender.
"""

import hashlib
import os
import re
from pathlib import Path
from typing import Final

from action_assistant.errors import BadInput, NotFound
from action_assistant.private_files import make_folder, replace_file
from action_assistant.umrf.questions import LARGEST_PHOTO
from action_assistant.web.workers.lanes import RunInWorker

FOLDER: Final = "photos"
#: The media types of photos, by the ending of their id.
MEDIA_TYPES: Final = {"jpg": "image/jpeg", "png": "image/png", "webp": "image/webp"}
_ID: Final = re.compile(r"[0-9a-f]{32}\.(jpg|png|webp)")
_RUN: Final = re.compile(r"[A-Za-z0-9]{1,64}")


class Photos:
    """Stores the photos of runs, and reads them. `folder`: of all; `on_disk` calls a function in a
    thread."""

    def __init__(self, folder: Path, on_disk: RunInWorker) -> None:
        self._folder = folder
        self._on_disk = on_disk

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

    def _place(self, run: str) -> Path:
        if not _RUN.fullmatch(run):
            raise NotFound("There is no such run.")
        return self._folder / run


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
