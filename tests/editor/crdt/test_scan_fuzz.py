"""The scanner against the CRDT library: what it passes is harmless, what clients make it passes."""

import os
import random
import subprocess
import sys
from collections import Counter
from typing import Any, Final

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pycrdt import Array, Doc, Map, Text, merge_updates

from action_assistant.editor.crdt.messages import Malformed, number
from action_assistant.editor.crdt.updates.update_scan import outline
from editor import forged_updates
from editor.crdt.test_scan import made, values
from support.doses import examples

MUTANTS: Final = int(os.environ.get("TEST_MUTANTS", "20000"))
SLOWEST: Final = 250.0  # ms of processor time
LARGEST: Final = 60.0  # MB


def base() -> tuple[bytes, list[bytes]]:
    """A document with everything in it, and the updates that make one."""
    doc: Doc[Any] = Doc(client_id=7)
    things, text = doc.get("things", type=Map), doc.get("text", type=Text)

    def edit() -> None:
        things["nested"] = Map({"list": Array([1.0, Map({"deep": "x"})])})
        for n in range(12):
            things[f"k{n % 4}"] = [n, {"a": "é", "b": b"bytes"}, None, 2.5, True]
            text.insert(0, "é😀")
        text.format(0, 2, {"bold": True})
        text.insert(len(str(text).encode()) // 99, "end")
        del things["k1"]
        del things["nested"]["list"][0]
        del text[1:3]

    updates = made(doc, edit)
    return doc.get_update(), [*updates, doc.get_update(), merge_updates(*updates)]


def devoured(start: bytes, updates: list[bytes]) -> list[tuple[str, float, float]]:
    """Return the results of updates that a separate process applied. Fails where that process
    dies."""
    run = subprocess.run(
        [sys.executable, "-m", "editor.apply_updates"],
        input="\n".join(update.hex() for update in (start, *updates)),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    lines = run.stdout.splitlines()
    if run.returncode != 0:
        last = sum(line.startswith("ready") for line in lines) - 1
        raise AssertionError(
            f"{updates[last].hex()[:2000]} ends the process: {run.returncode} {run.stderr[-500:]}"
        )
    fates = [line.split() for line in lines if not line.startswith("ready")]
    return [(found, float(spent), float(grown)) for found, spent, grown in fates]


def mutated(chance: random.Random, update: bytes, other: bytes) -> bytes:
    """Return a random mutation of an update."""
    forged = bytearray(update)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(forged))
        match chance.randrange(6):
            case 0:
                forged[place] = chance.randrange(256)
            case 1:
                forged[place] ^= 1 << chance.randrange(8)
            case 2:
                forged[place:place] = number(chance.choice([0, 1, 127, 2**14, 2**31, 2**53, 2**63]))
            case 3:
                del forged[place : place + chance.randint(1, 4)]
            case 4:
                begin = chance.randrange(len(other))
                forged[place:place] = other[begin : begin + chance.randint(1, 30)]
            case _:
                forged[place:place] = forged[place : place + chance.randint(1, 30)]
        forged = forged or bytearray(b"\x00")
    return bytes(forged)


@pytest.mark.slow
def test_no_accepted_update_kills_the_process_or_costs_much() -> None:
    chance = random.Random(int(os.environ.get("TEST_SEED", "11")))
    start, updates = base()
    passed: list[bytes] = []
    for _ in range(MUTANTS):
        forged = mutated(chance, chance.choice(updates), chance.choice(updates))
        try:
            outline(forged)
        except Malformed:
            continue
        passed.append(forged)
    assert len(passed) > MUTANTS / 50
    fates = devoured(start, passed)
    assert len(fates) == len(passed)
    assert max(spent for _, spent, _ in fates) < SLOWEST
    assert max(grown for _, _, grown in fates) < LARGEST
    assert Counter(found for found, _, _ in fates)["taken"] > 0


def test_updates_that_kill_the_library_are_refused() -> None:
    killers = [
        *(forged_updates.nested_values(depth) for depth in (100, 1000, 30_000, 300_000)),
        bytes.fromhex("8be0cc71"),
        bytes.fromhex("0101cc86dce28bb68f0a6688cc865d7c0000"),
    ]
    for killer in killers:
        with pytest.raises(Malformed):
            outline(killer)
    start, _ = base()
    chains = [forged_updates.nested_types(depth, client=9) for depth in (33, 34, 1000, 40_000)]
    assert [found for found, _, _ in devoured(start, chains)] == ["taken", *["refused"] * 3]


steps = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.sampled_from("abcd"), values),
        st.tuples(st.just("erase"), st.sampled_from("abcd"), st.none()),
        st.tuples(st.just("nest"), st.sampled_from("abcd"), st.none()),
        st.tuples(st.just("push"), st.just(""), values),
        st.tuples(st.just("write"), st.text(max_size=8), st.none()),
    ),
    min_size=1,
    max_size=25,
)


@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(steps, min_size=1, max_size=3), st.randoms(use_true_random=False))
def test_all_updates_of_real_clients_are_accepted(
    people: list[list[tuple[str, str, Any]]], chance: random.Random
) -> None:
    docs = [Doc[Any]() for _ in people]
    updates: list[bytes] = []
    for doc, plan in zip(docs, people, strict=True):
        updates += made(doc, lambda doc=doc, plan=plan: perform(doc, plan))  # type: ignore[misc]
    for doc in docs:
        for update in updates:
            doc.apply_update(update)
    for doc, plan in zip(docs, people, strict=True):
        updates += made(doc, lambda doc=doc, plan=plan: perform(doc, plan))  # type: ignore[misc]
    for update in (*updates, merge_updates(*updates), *(doc.get_update() for doc in docs)):
        outline(update)


def perform(doc: Doc[Any], plan: list[tuple[str, str, Any]]) -> None:
    things, text = doc.get("things", type=Map), doc.get("text", type=Text)
    items = doc.get("items", type=Array)
    for step, key, value in plan:
        match step:
            case "set":
                things[key] = value
            case "erase" if key in things:
                del things[key]
            case "nest":
                things[key] = Map({"list": Array([1.0, "é"]), "more": Map({"k": "v"})})
            case "push":
                items.append(value)
            case "write":
                text.insert(0, key)
