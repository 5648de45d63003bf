"""Compresses large documents before they are stored or sent to another process.

What is packed must not begin with the byte 0x78, as MessagePack of an array does not: then bytes that were stored
plain are told from packed ones, and both are read.
"""

import zlib
from typing import Final

_ZLIB: Final = b"\x78"  # the first byte of everything that zlib compresses


def packed(plain: bytes, *, least: int) -> bytes:
    """Return the bytes compressed by zlib, or unchanged if there are fewer than `least`.
    Compressing holds no interpreter lock, so it can run on a thread."""
    return plain if len(plain) < least else zlib.compress(plain, level=1)


def is_packed(stored: bytes) -> bool:
    """Return whether stored bytes are the output of `packed` in its compressed form."""
    return stored[:1] == _ZLIB


def unpacked(stored: bytes) -> bytes:
    """Return the bytes that were given to `packed`. Plain and damaged bytes are returned unchanged:
    a decoder finds that damaged ones are no document."""
    if not is_packed(stored):
        return stored
    try:
        return zlib.decompress(stored)
    except zlib.error:
        return stored
