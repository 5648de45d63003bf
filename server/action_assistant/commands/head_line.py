"""The line that `verify --head` prints and an owner keeps elsewhere: where the logs ended, maybe signed.

    action-assistant-heads 1 TIME editor POSITION SHA256 runner POSITION SHA256 ed25519 KEY SIGNATURE

TIME is in UTC, for people. A log that is not there is not named. KEY (public) and SIGNATURE are in base64;
what is signed is everything before `ed25519`, without the space.
"""

import re
from base64 import b64decode, b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.heads import LogHead
from action_assistant.journal.slots import Cursor

_MARK: Final = "action-assistant-heads"
_LINE: Final = re.compile(
    rf"(?P<signed>{_MARK} 1 (?P<time>\S{{1,40}})(?P<heads>(?: (?:editor|runner) [0-9.]{{1,960}} [0-9a-f]{{64}}){{1,2}}))"
    r"(?: ed25519 (?P<key>[A-Za-z0-9+/]{43}=) (?P<signature>[A-Za-z0-9+/]{86}==))?"
)
_HEAD: Final = re.compile(r"(editor|runner) ([0-9.]+) ([0-9a-f]{64})")
_NEW_KEY: Final = "openssl genpkey -algorithm ed25519 -out"


class HeadLine(msgspec.Struct, frozen=True):
    """A parsed line of `verify --head`. `heads`: the end of each log; `key`: the public key of its
    signature in base64, "" where it has none."""

    time: str
    heads: dict[Branch, LogHead]
    key: str = ""


def written(time: str, heads: Mapping[Branch, LogHead], key: Ed25519PrivateKey | None) -> str:
    """Return the line of `verify --head` for the ends of the logs at this time, signed if there is
    a key."""
    named = (f"{branch} {head.cursor} {head.digest}" for branch, head in sorted(heads.items()))
    line = " ".join((_MARK, "1", time, *named))
    if key is None:
        return line
    signature = b64encode(key.sign(line.encode())).decode()
    return f"{line} ed25519 {_public(key.public_key())} {signature}"


def read(text: str, key: Ed25519PublicKey | None) -> HeadLine:
    """Parse a line of `verify --head`, and verify its signature, if it has one, with the public key
    in the line. With `key`, the line must be signed by exactly this key. Raise CannotStart if the
    text is no such line, if its signature does not match, or if `key` is not None and the line is
    unsigned or signed by another key."""
    found = _LINE.fullmatch(text.strip())
    if found is None:
        raise CannotStart("That is no line of `verify --head`: a part of it may be missing.")
    if found["key"] is None:
        if key is not None:
            raise CannotStart("The line is not signed, though --key names a key.")
    else:
        if key is not None and _public(key) != found["key"]:
            raise CannotStart(f"The line was signed by another key ({found['key']}).")
        public = Ed25519PublicKey.from_public_bytes(b64decode(found["key"]))
        try:
            public.verify(b64decode(found["signature"]), found["signed"].encode())
        except InvalidSignature as error:
            raise CannotStart("The line is not what was signed: it was altered.") from error
    heads: dict[Branch, LogHead] = {}
    for branch, moment, digest in _HEAD.findall(found["heads"]):
        try:
            heads[branch] = LogHead(Cursor.parse(moment), digest)
        except ValueError as error:
            raise CannotStart(f"{moment} is no moment of a log.") from error
    return HeadLine(found["time"], heads, found["key"] or "")


def signing_key(path: Path, data: Path) -> Ed25519PrivateKey:
    """Read the owner's private ed25519 key from the PEM file `path`, which must be outside of the
    data folder. Raise CannotStart if the file is not such a key."""
    text = _key_file(path, data)
    try:
        key = serialization.load_pem_private_key(text, password=None)
    except (ValueError, TypeError) as error:
        raise CannotStart(f"{path} is no private key without a password. {_how(path)}") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise CannotStart(f"{path} is a key of another kind. {_how(path)}")
    return key


def proving_key(path: Path, data: Path) -> Ed25519PublicKey:
    """Return the public key that verifies the signature of a line, from the PEM file `path`, which
    holds a public or a private ed25519 key. Raise CannotStart if the file cannot be read, holds no
    such key, or lies in the data folder `data`."""
    text = _key_file(path, data)
    if b"PRIVATE KEY" in text:
        return signing_key(path, data).public_key()
    try:
        key = serialization.load_pem_public_key(text)
    except ValueError as error:
        raise CannotStart(f"{path} is no public key in a PEM file.") from error
    if not isinstance(key, Ed25519PublicKey):
        raise CannotStart(f"{path} is a key of another kind than ed25519.")
    return key


def _key_file(path: Path, data: Path) -> bytes:
    """Read the key file `path`. Raise CannotStart if it cannot be read or lies in the data folder,
    where any person who alters the logs could also sign them."""
    if path.resolve().is_relative_to(data.resolve()):
        raise CannotStart(
            f"{path} is in the data folder: whoever can alter the logs could sign anew. Keep the key "
            "elsewhere."
        )
    try:
        return path.read_bytes()
    except OSError as error:
        raise CannotStart(f"Cannot read the key {path}: {error.strerror}. {_how(path)}") from error


def _how(path: Path) -> str:
    return f"`{_NEW_KEY} {path}` makes one."


def _public(key: Ed25519PublicKey) -> str:
    raw = key.public_bytes(serialization.Encoding.Raw, serialization.PublicFormat.Raw)
    return b64encode(raw).decode()
