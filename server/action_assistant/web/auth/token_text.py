"""The text of a token of a program: `aat_ID_SECRET_CRC`. Pure, and imported by commands too."""

import hashlib
import hmac
import re
import secrets
import string
import zlib
from typing import Final

PREFIX: Final = "aat_"
_CHARACTERS: Final = string.digits + string.ascii_uppercase + string.ascii_lowercase
_SECRET: Final = 43  # characters: 256 bit
_CRC: Final = 6  # characters: 32 bit
_FORM: Final = re.compile(
    rf"aat_(?P<id>[A-Za-z0-9]{{12}})_[A-Za-z0-9]{{{_SECRET}}}_(?P<crc>[A-Za-z0-9]{{{_CRC}}})"
)


def new_text(token_id: str) -> str:
    """Return the text of a new token: `aat_ID_SECRET_CRC`."""
    secret = "".join(secrets.choice(_CHARACTERS) for _ in range(_SECRET))
    body = f"{PREFIX}{token_id}_{secret}"
    return f"{body}_{checksum(body)}"


def checksum(body: str) -> str:
    """Return the CRC-32 of `aat_ID_SECRET` in 6 characters of base 62, so that programs that look
    for leaked secrets can tell a token from a text that resembles one."""
    left, found = zlib.crc32(body.encode()), ""
    for _ in range(_CRC):
        left, digit = divmod(left, len(_CHARACTERS))
        found = _CHARACTERS[digit] + found
    return found


def token_id(text: str) -> str | None:
    """Return the id in the text of a token; None if the text is not a whole token."""
    found = _FORM.fullmatch(text)
    if found is None or checksum(text[: -_CRC - 1]) != found["crc"]:
        return None
    return found["id"]


def digest_of(text: str) -> str:
    """Return the SHA-256 of a token in hex, which servers keep in its place."""
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()


def proof(sha256: str, challenge: str, address: str) -> str:
    """Return the proof that whoever computes it knows the digest of a token: an HMAC over a challenge
    and over the address, `HOST:PORT`, that accepted the connection."""
    text = f"action-assistant token\0{challenge}\0{address}"
    return hmac.new(sha256.encode(), text.encode(errors="replace"), "sha256").hexdigest()
