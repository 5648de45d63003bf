"""The fingerprint of what a document shows, which a page can make too, without cryptography.

Equal state vectors do not prove equal documents. So pages and rooms compare what is shown: per entry
of the shared maps the CRC-32 of

    root, 0, key, 0, value        root and key as UTF-8

and of all of them the number and the sum, which need no order. A value is `s` and its text as UTF-8,
`n` and a little-endian double (`-0` is `0`), `t` or `f`, or `a` and the doubles of a list of numbers;
any other value is `?`, since no client of ours writes one.
"""

from struct import pack
from zlib import crc32

import msgspec

from action_assistant.editor.documents.document import Maps


class Fingerprint(msgspec.Struct, frozen=True):
    """The number of entries of a document and the sum of their CRCs, which is below 2^53 for any
    allowed document."""

    entries: int
    total: int


def fingerprint(maps: Maps) -> Fingerprint:
    """Return the fingerprint of the content of a document, given by its root maps."""
    entries = total = 0
    for root, fields in maps.items():
        head = root.encode() + b"\0"
        for key, value in fields.items():
            entries += 1
            total += crc32(head + key.encode("utf-8", "surrogatepass") + b"\0" + _bytes(value))
    return Fingerprint(entries, total)


def _bytes(value: object) -> bytes:
    match value:
        case bool():
            return b"t" if value else b"f"
        case str():
            return b"s" + value.encode("utf-8", "surrogatepass")
        case int() | float():
            return b"n" + _double(value)
        case list() if all(isinstance(n, int | float) and n is not True and n is not False for n in value):  # fmt: skip
            return b"a" + b"".join(_double(n) for n in value)
        case _:
            return b"?"


def _double(value: float) -> bytes:
    return pack("<d", float(value) + 0.0)
