"""What was generated last, kept in the package as one file: the base of the next merge.

One file, and a hidden one: a second `package.xml` would be a second package to who looks for them. Texts
are lists of lines, so that histories of changes show it by lines, and merge it.
"""

import hashlib
from collections.abc import Iterable, Mapping
from typing import Final

import msgspec

#: Below the folder of the package.
BASE_NAME: Final = ".generated.json"
_ABOUT: Final = (
    "What `action-assistant package` generated last. It merges by it, so keep it with the sources."
)


class UnreadableBase(Exception):
    """The file is no base. The message is the end of a sentence."""


class UnfinishedFile(msgspec.Struct, frozen=True):
    """A file that a call began to write: `digest` of what it was to hold, and `text` generated for it."""

    digest: str
    text: bytes


class GenerationBase(msgspec.Struct, frozen=True):
    """Texts by path below the package. `unfinished` is there while a call writes, or if it was killed."""

    files: dict[str, bytes] = {}
    unfinished: dict[str, UnfinishedFile] = {}

    def settled(self, there: Mapping[str, bytes]) -> dict[str, bytes]:
        """What each file was made from. Of an unfinished call that is the newer text where its file
        arrived: merging it in once more could repeat lines. What was not there before it came by it,
        also if it was edited since."""
        arrived = {
            path: each.text
            for path, each in self.unfinished.items()
            if path in there and (path not in self.files or digest(there[path]) == each.digest)
        }
        return self.files | arrived


class _StoredUnfinished(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    digest: str
    lines: list[str]


class _StoredBase(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    about: str
    format: int
    files: dict[str, list[str]]
    unfinished: dict[str, _StoredUnfinished] = {}


def digest(content: bytes) -> str:
    """By which an unfinished file is known again."""
    return hashlib.sha256(content).hexdigest()


def write_base(base: GenerationBase) -> bytes:
    """The content of the file."""
    stored = _StoredBase(
        about=_ABOUT,
        format=1,
        files={path: _lines(text) for path, text in sorted(base.files.items())},
        unfinished={
            path: _StoredUnfinished(each.digest, _lines(each.text))
            for path, each in sorted(base.unfinished.items())
        },
    )
    return msgspec.json.format(msgspec.json.encode(stored), indent=1) + b"\n"


def read_base(content: bytes) -> GenerationBase:
    """Raises `UnreadableBase`."""
    try:
        stored = msgspec.json.decode(content, type=_StoredBase)
        if stored.format != 1:
            raise UnreadableBase("it is of a newer version of this program")
        return GenerationBase(
            {path: _joined(lines) for path, lines in stored.files.items()},
            {
                path: UnfinishedFile(each.digest, _joined(each.lines))
                for path, each in stored.unfinished.items()
            },
        )
    except (msgspec.DecodeError, UnicodeError) as error:
        raise UnreadableBase(f"it is no record of what was generated ({error})") from error


def _lines(text: bytes) -> list[str]:
    return text.decode().split("\n")


def _joined(lines: Iterable[str]) -> bytes:
    return "\n".join(lines).encode()
