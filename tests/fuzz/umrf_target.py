"""Properties that hold for any bytes that are given as a UMRF file."""

import json
import resource
import time

from action_assistant.umrf.check import blocking, check_action, check_reading, refused_by_parser
from action_assistant.umrf.codes import CODES
from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import (
    Reading,
    Unreadable,
    read,
    read_action,
    stamp_of,
    write,
    write_action,
)
from action_assistant.umrf.fixes import fix
from action_assistant.umrf.json.text import MAX_BYTES
from action_assistant.umrf.semantics import simulate
from action_assistant.umrf.signatures import signature_of

REFERENCE = 0.05  # s of processor for the work of `_slowness`, where the bounds were set
MEGABYTES = 1_500  # of the whole process: the interpreter, the fuzzer, ten times the text


def examine(data: bytes) -> bool:
    """Return whether the bytes are a graph. Raises AssertionError, or any error that must not be
    raised."""
    examine_action(data)
    started = time.process_time()
    try:
        reading = read(data)
    except Unreadable as error:
        refusal = error
    else:
        return _examine_graph(data, reading, started)
    assert refusal.code in CODES
    assert refusal.message
    return False


def examine_action(data: bytes) -> bool:
    """Return whether the bytes are the file of an action; raises as `examine` does."""
    try:
        reading = read_action(data)
    except Unreadable:
        return False
    for problem in check_action(reading):
        assert problem.severity in CODES[problem.code].severities, problem
    signature_of(reading.action)
    text = write_action(reading.action)
    if len(text) <= MAX_BYTES:
        again = read_action(text)
        assert again.dialect == "D3-action", again.dialect
        assert write_action(again.action) == text
    return True


def _examine_graph(data: bytes, reading: Reading, started: float) -> bool:
    stamp_of(data)
    problems = check_reading(reading)
    for problem in problems:
        assert problem.severity in CODES[problem.code].severities, problem
        assert problem.message
    assert set(refused_by_parser(reading)) <= set(problems)
    assert set(blocking(problems)) <= set(problems)
    _round_trip(data)
    digest(echo(reading.graph, PINNED))
    if len(data) < 50_000:
        for problem in problems[:20]:
            fix(reading.graph, problem)
        inner = {action.name: reading.graph for action in reading.graph.actions[:2]}
        check_reading(reading, {}, PINNED, inner)
        for facts in (PINNED, None):
            chosen = {} if facts is None else {"facts": facts}
            trace = simulate(reading.graph, states=reading.states, max_events=300, **chosen)
            assert sum(1 for _ in trace) <= 301  # the last one says that it was cut off
    spent = time.process_time() - started
    allowed = 2 + 20e-6 * len(data) + 200e-6 * data.count(b"{")
    if spent >= allowed:
        allowed *= _slowness()
    assert spent < allowed, f"{spent:.1f} s for {len(data)} bytes"
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    assert used < MEGABYTES, f"{used:.0f} MB"
    return True


def _slowness() -> float:
    """Return how many times slower this machine is now than the one that set the bounds; at
    least 1."""
    started = time.process_time()
    for _ in range(4):
        json.loads(json.dumps([{"name": str(n), "at": [n, {}]} for n in range(20_000)]))
    return max(1.0, (time.process_time() - started) / 4 / REFERENCE)


def _round_trip(data: bytes) -> None:
    """Check that a written graph is read as the same graph, and that writing it again changes
    nothing."""
    graph = read(data).graph
    text = write(graph)
    if len(text) > MAX_BYTES:
        return
    again = read(text)
    assert again.dialect == "D3", again.dialect
    assert digest(again.graph) == digest(graph)
    assert write(again.graph) == text
