"""The base of the next merge: the texts that were generated last, kept in the package as one hidden
file.

A second visible `package.xml` would be a second package to programs that look for them. Texts are
lists of lines, so that version control shows and merges them by line.
"""

import hashlib
from collections.abc import Iterable, Mapping
from typing import Final

import msgspec

#: The path of the file below the folder of the package.
BASE_NAME: Final = ".generated.json"
_ABOUT: Final = (
    "What `action-assistant package` generated last. It merges by it, so keep it with the sources."
)


class UnreadableBase(Exception):
    """Raised for a file that is no base. The message is the end of a sentence."""


class UnfinishedFile(msgspec.Struct, frozen=True):
    """A file that a call began to write. `digest`: the hash of its intended content; `text`: the
    text generated for it."""

    digest: str
    text: bytes


class GenerationBase(msgspec.Struct, frozen=True):
    """The generated texts by path below the package. `unfinished`: files that a running or killed
    call is writing."""

    files: dict[str, bytes] = {}
    unfinished: dict[str, UnfinishedFile] = {}

    def settled(self, there: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return the generated text on which each file is based, by path. `there`: the contents of
        the present files. If a call was interrupted, this is the newer text for each file that it
        has written: to merge that again could repeat lines. A file that was not generated before
        came from that call, even if it was edited since."""
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
    """Return the SHA-256 of a file's content in hexadecimal, by which a later call recognises a
    file that an interrupted call has written."""
    return hashlib.sha256(content).hexdigest()


def write_base(base: GenerationBase) -> bytes:
    """Return the content of the base file, which stores the texts generated last."""
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
    """Read the content of the base file. Raise `UnreadableBase` if it is malformed or of a newer
    version."""
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
