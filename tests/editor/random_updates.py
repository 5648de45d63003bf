"""Updates of random structs: each can be read, few would be written by a client."""

import random
from collections.abc import Mapping
from typing import Final

from action_assistant.editor.crdt.messages import number, text

_KINDS: Final = (0, 1, 3, 4, 5, 6, 7, 8, 9)
_ANY: Final = (
    b"\x7f", b"\x7e", b"\x7d\x07", b"\x7c\x40\x00\x00\x00", b"\x7b" + b"\x41" * 8, b"\x7a" + b"\x00" * 7 + b"\x01",
    b"\x7a" + b"\x7f" * 8, b"\x7d\xff\xff\xff\xff\xff\xff\xff\x0f", b"\x78", b"\x79", b"\x77\x02ab", b"\x75\x02\x7f\x7e",
    b"\x76\x01\x01a\x7e", b"\x74\x02\xff\x00", b"\x76\x01\x09__proto__\x76\x00", b"\x7b\x7f\xf8" + b"\x00" * 6,
)  # fmt: skip
_TEXTS: Final = ("", "a", "abc", "é", "😀", "x😀y", "😀😀", "\ufeff")
_JSON: Final = ("null", "true", '{"a":1}', '"x"', "[1,[2]]", "1e400", '{"__proto__":1}', "-0")


def random_update(
    chance: random.Random, client: int, clock: int, known: Mapping[int, int], *, most: int = 4
) -> bytes:
    """Some structs of a client from this clock on, and some deletions, beside what is known."""
    structs: list[bytes] = []
    reached = dict(known) | {client: clock}
    for _ in range(chance.randint(0, most)):
        struct, length = _struct(chance, reached)
        structs.append(struct)
        reached[client] += length
    deleted = [_range(chance, reached[each]) for each in reached if chance.random() < 0.3]
    owners = [number(each) for each in reached][: len(deleted)]
    deletions = [owner + b"\x01" + found for owner, found in zip(owners, deleted, strict=True)]
    head = number(len(structs)) + number(client) + number(clock) + b"".join(structs)
    return (b"\x01" + head if structs else b"\x00") + number(len(deletions)) + b"".join(deletions)


def _range(chance: random.Random, end: int) -> bytes:
    start = chance.randint(0, end)
    return number(start) + number(chance.randint(0, max(0, end - start)))


def _id(chance: random.Random, reached: Mapping[int, int]) -> bytes:
    client = chance.choice(list(reached))
    return number(client) + number(chance.randrange(max(1, reached[client])))


def _struct(chance: random.Random, reached: Mapping[int, int]) -> tuple[bytes, int]:
    """One struct, and how many clocks it takes."""
    kind = chance.choice(_KINDS)
    if kind == 0:
        length = chance.randint(1, 4)
        return b"\x00" + number(length), length
    flags = chance.choice((0, 0x20, 0x40, 0x80, 0xC0, 0xA0))
    place = b"".join(_id(chance, reached) for flag in (0x80, 0x40) if flags & flag)
    if not place:
        root = chance.choice(("text", "things", "items", "actions"))
        place = chance.choice((b"\x01" + text(root.encode()), b"\x00" + _id(chance, reached)))
        if flags & 0x20:
            place += text(chance.choice((b"a", b"k1", b"nested")))
    content, length = _content(chance, kind)
    return bytes((kind | flags,)) + place + content, length


def _content(chance: random.Random, kind: int) -> tuple[bytes, int]:
    count = chance.randint(1, 3)
    match kind:
        case 1:
            return number(count), count
        case 3:
            return text(b"\xff\x00"), 1
        case 4:
            word = chance.choice(_TEXTS)
            return text(word.encode()), len(word.encode("utf-16-le")) // 2
        case 5:
            return text(chance.choice(_JSON).encode()), 1
        case 6:
            return text(b"bold") + text(chance.choice(_JSON).encode()), 1
        case 7:
            shared = chance.randrange(16)
            return number(shared) + (text(b"p") if shared in {3, 5} else b""), 1
        case 9:
            options = chance.choice((b"\x76\x00", b"\x76\x01\x02gc\x79", *_ANY))
            return text(b"guid") + options, 1
        case _:
            return number(count) + b"".join(chance.choices(_ANY, k=count)), count
