"""The scanner against the page's own Yjs: what a room takes and gives out, every page can apply."""

import json
import os
import random
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import pytest
from pycrdt import Doc

from action_assistant.editor.crdt.applying import Panicked, clocks
from action_assistant.editor.crdt.messages import Malformed, text
from action_assistant.editor.crdt.replica import Replica, UpdateEffect
from action_assistant.editor.crdt.updates.small_update import small_outline
from action_assistant.editor.crdt.updates.update_scan import outline, stored_outline
from action_assistant.editor.rooms.batch import merged
from editor.crdt.test_scan_fuzz import base, mutated
from editor.random_updates import random_update
from support.page import FRONTEND

#: If a person writes several values for one key of a map inside a map, then something between
#: those, and the map is deleted, pages that are there fail; pages that come later do not.
COLLECTING: Final = "Error: Unexpected case"
CASES: Final = int(os.environ.get("TEST_PAGE_CASES", "1500"))
SEED: Final = int(os.environ.get("TEST_SEED", "13"))

#: Updates into a new document, and the clocks that it should have then, where that is known.
Case: TypeAlias = tuple[list[bytes], dict[int, int] | None]


def in_action(kind: int, content: bytes) -> bytes:
    """An update with one struct, at a key of the actions."""
    place = b"\x01" + text(b"actions") + text(b"k")
    return b"\x01\x01\x07\x00" + bytes((0x20 | kind,)) + place + content + b"\x00"


def in_text(kind: int, content: bytes) -> bytes:
    """An update with one struct, in a text."""
    return b"\x01\x01\x07\x00" + bytes((kind,)) + b"\x01" + text(b"text") + content + b"\x00"


def of_json(kind: int, value: str) -> bytes:
    """An embed, or a format."""
    return in_text(kind, (text(b"bold") if kind == 6 else b"") + text(value.encode()))


BEYOND: Final = b"\xff" * 8 + b"\x7f"
#: The library takes these, and Yjs fails at them or at what the library makes of them.
POISONS: Final = {
    "undefined type": in_action(7, b"\x0f"),
    "sub-document as a type": in_action(7, b"\x09"),
    "hook": in_action(7, b"\x05\x01p"),
    "whole number": in_action(8, b"\x01\x7d" + BEYOND),
    "whole number in an object": in_action(8, b"\x01\x76\x01\x01a\x7d" + BEYOND),
    "whole number above": in_action(8, b"\x01\x7d" + b"\xbf" + BEYOND[1:]),
    "sub-document without options": in_action(9, b"\x01g\x7e"),
    "sub-document that names itself": in_action(9, b"\x01g\x76\x01\x04guid\x7e"),
    "stands on itself": b"\x01\x01\x07\x00\x84\x07\x00\x01a\x00",
    "stands before itself": b"\x01\x01\x07\x00\x44\x07\x00\x01a\x00",
    "stands on a later one": b"\x01\x02\x07\x00\x84\x07\x01\x01a\x04\x01\x01t\x01b\x00",
    "lies in itself": b"\x01\x01\x07\x00\x27\x00\x07\x00\x01k\x01\x00",
    "empty text at the end": b"\x01\x02\x07\x00\x04\x01\x01t\x01a\x84\x07\x00\x00\x00",
    "empty text before a gap": b"\x01\x03\x07\x00\x04\x01\x01t\x01a\x84\x07\x00\x00\x0a\x05\x00",
    "deletes nothing": b"\x00\x01\x07\x01\x03\x00",
}
#: The poisons, and updates at which Yjs would fail if the library did not.
REFUSED: Final = POISONS | {
    "texts of JSON": bytes.fromhex("01010700220107616374696f6e73016b01097b6e6f74206a736f6e010000"),
    "texts of sound JSON": in_action(2, b"\x02\x011\x012"),
    "empty text": in_text(4, b"\x00"),
    "other types": in_action(7, b"\x07"),
    "sub-document without an object": in_action(9, b"\x01g\x75\x00"),
    "whole number without end": in_action(8, b"\x01\x7d" + b"\x80" * 20 + b"\x00"),
    **{
        f"{name}: {value!r}": of_json(kind, value)
        for kind, name in ((5, "embed"), (6, "format"))
        for value in ("", "{", "NaN", "-Infinity", "undefined", "[" * 5000, "\ufeff1")
    },
}
#: Updates that clients really write.
HONEST: Final = {
    **{f"type {kind}": in_action(7, bytes((kind,))) for kind in (0, 1, 2, 4, 6)},
    "element": in_action(7, b"\x03\x01p"),
    "sub-document": in_action(9, b"\x01g\x76\x02\x02gc\x79\x08autoLoad\x78"),
    "sub-document of the library": in_action(
        9, bytes.fromhex("01677604086175746f4c6f61647908656e636f64696e677d01026763780a73686f756c644c6f616479")
    ),
    "largest whole number": in_action(8, b"\x01\x7d\xbf" + b"\xff" * 6 + b"\x1f"),
    "smallest whole number": in_action(8, b"\x01\x7d\xff" + b"\xff" * 6 + b"\x1f"),
    "bigint": in_action(8, b"\x01\x7a\x7f" + b"\xff" * 7),
    "undefined": in_action(8, b"\x01\x75\x02\x7f\x7e"),
    "no number": in_action(8, b"\x01\x7b\x7f\xf8" + bytes(6)),
    "embed": of_json(5, '{"image": "\\u00e9", "n": [1, 2.5e3, null]}'),
    "format": of_json(6, "true"),
    "mark of an order of bytes": in_text(4, text("\ufeff".encode())),
    "two units": in_text(4, text("😀".encode())),
}  # fmt: skip
#: Text that is no UTF-8, in every place; the scanner leaves some of them to the library.
BYTES: Final = {
    "value": in_action(8, b"\x01\x77\x01\xff"),
    "key of an object": in_action(8, b"\x01\x76\x01\x01\xff\x7e"),
    "half of a pair": in_action(8, b"\x01\x77\x03\xed\xa0\x80"),
    "key": b"\x01\x01\x07\x00\x28\x01\x01a\x01\xff\x01\x7e\x00",
    "root": b"\x01\x01\x07\x00\x28\x01\x01\xff\x01k\x01\x7e\x00",
    "name of a sub-document": in_action(9, b"\x01\xff\x76\x00"),
    "name of a format": in_text(6, b"\x01\xff\x04true"),
    "text": in_text(4, b"\x01\xff"),
}


def faults(cases: Sequence[Case]) -> list[str | None]:
    """Return the error of Yjs for each case, or None. Skips the test where there is no Yjs."""
    fetched = FRONTEND.parent / ".node" / "bin" / "node"  # by scripts/with-node
    node = str(fetched) if fetched.exists() else shutil.which("node")
    if node is None or not (FRONTEND / "node_modules" / "yjs").is_dir():
        pytest.skip("needs Node and the page's packages: make setup")
    told = [
        {
            "updates": [update.hex() for update in updates],
            "clocks": None if clocks is None else list(clocks.items()),
        }
        for updates, clocks in cases
    ]
    script = Path(__file__).parents[1] / "yjs_applies.mjs"
    run = subprocess.run(
        [node, str(script), str(FRONTEND)],
        input=json.dumps(told),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    found: list[str | None] = json.loads(run.stdout)
    assert len(found) == len(cases)
    return found


def known_of(replica: Replica) -> dict[int, int]:
    """Return the clock of each client that a replica has seen."""
    return clocks(replica.doc.get_state())


def given_out(replica: Replica) -> Case:
    """A page that comes later."""
    return [replica.lacking(b"\x00")], known_of(replica)


@pytest.mark.parametrize("name", REFUSED)
def test_updates_that_fail_in_a_page_are_refused(name: str) -> None:
    update = REFUSED[name]
    assert small_outline(update) is None
    with pytest.raises(Malformed):
        outline(update)
    with pytest.raises(Malformed):
        Replica().take(update, "eve")


@pytest.mark.parametrize("name", BYTES)
def test_text_that_is_no_utf_8_is_refused(name: str) -> None:
    replica = Replica()
    with pytest.raises(Malformed):
        replica.take(BYTES[name], "eve")
    assert replica.lacking(b"\x00") == b"\x00\x00"


def test_a_page_does_fail_at_what_is_refused() -> None:
    """Yjs fails at the update itself, or at the state that the library makes of it."""
    cases: list[Case] = []
    for update in POISONS.values():
        doc: Doc[Any] = Doc()
        doc.apply_update(update)
        cases += ([update], None), ([doc.get_update()], None)
    found = faults(cases)
    harmless = [n for n, both in zip(POISONS, pairs(found), strict=True) if both == (None, None)]
    assert harmless == []


def pairs(found: Sequence[str | None]) -> list[tuple[str | None, str | None]]:
    """Two at a time."""
    return list(zip(found[::2], found[1::2], strict=True))


def test_a_page_applies_what_clients_write_and_what_is_made_of_it() -> None:
    cases: list[Case] = []
    for update in HONEST.values():
        replica = Replica()
        assert replica.take(update, "ada") is UpdateEffect.NEWS
        cases += ([update], known_of(replica)), given_out(replica)
    assert [fault for fault in faults(cases) if fault is not None] == []


def sessions(chance: random.Random, count: int) -> list[Case]:
    """Return the updates that pages receive from rooms with random senders, for pages that are
    there and for pages that come later."""
    whole, updates = base()
    cases: list[Case] = []
    while len(cases) < 2 * count:
        replica = Replica()
        heard: list[bytes] = []
        for update in chance.choice(([whole], [b"\x00\x00"], updates[: chance.randrange(12)])):
            replica.take(update, "ada")
            heard.append(update)
        before = len(heard)
        for _ in range(chance.randint(1, 4)):
            client, known = chance.choice((7, 9, 11)), known_of(replica)
            reached = known.get(client, 0)
            start = reached if chance.random() < 0.8 else chance.randint(0, reached)
            forged = random_update(chance, client, start, known or {7: 0})
            if chance.random() < 0.3:
                forged = mutated(chance, chance.choice((forged, *updates)), chance.choice(updates))
            try:
                effect = replica.take(forged, "ada")
            except Malformed:
                continue
            except Panicked:  # the room loads its document anew
                heard = []
                break
            if effect is UpdateEffect.NEWS:
                heard += forged, *replica.released()
        if len(heard) > before:
            if chance.random() < 0.5:
                heard[before:] = merged(heard[before:])
            cases += (heard, known_of(replica)), given_out(replica)
    return cases


def test_a_page_applies_whatever_a_room_takes() -> None:
    cases = sessions(random.Random(SEED), CASES // 2)
    wrong: list[tuple[str, list[str]]] = []
    tolerated = 0
    for n, (fault, (updates, _)) in enumerate(zip(faults(cases), cases, strict=True)):
        if fault == COLLECTING and n % 2 == 0:
            tolerated += 1
        elif fault is not None:
            wrong.append((fault, [update.hex() for update in updates]))
    assert wrong[:3] == []
    assert tolerated < len(cases) / 100


@pytest.mark.parametrize("name", POISONS)
def test_updates_that_rooms_stored_before_are_still_read(name: str) -> None:
    assert stored_outline(POISONS[name]).structs == POISONS[name][1] * (POISONS[name][0] != 0)
