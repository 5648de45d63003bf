"""Identifies the operating system's process of an engine on this computer, its arguments and threads.

The code of an action has ended when the engine's process has, since all threads of a process end with it.
That can only be seen on this computer: in another container or after a reboot nothing is known.
"""

import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import msgspec

_PROC: Final = Path("/proc")
_PROGRAM: Final = "action_engine_node"  # the engine's own, as ROS 2 starts it
_FAST_DDS: Final = "010f"  # vendor id at the beginning of a GUID prefix
_FIRST_PORT: Final = 7400  # of DDS; each domain has the next 250
_PORTS: Final = 250
_NUM_THREADS: Final = 17  # its place among the fields of `stat` from the state on
_LOOKS: Final = 3  # at a list of threads of which one has just ended
_EMULATOR: Final = "simulate-robot"  # the command of this program that plays an engine


class Thread(msgspec.Struct, frozen=True):
    """One thread of a process. `began`: clock ticks after boot."""

    number: int
    began: int


class EngineProcess(msgspec.Struct, frozen=True):
    """One process. `boot`: the kernel's boot id; `namespace`: that of process ids; `started`: clock
    ticks after boot. Together with `pid` they identify it for ever."""

    boot: str
    namespace: str
    pid: int
    started: int


def process(pid: int) -> EngineProcess | None:
    """Return the process with the id `pid`; None if it does not exist or the kernel does not show
    it."""
    try:
        started = _started(pid)
        return None if started is None else EngineProcess(*_here(), pid, started)
    except OSError:
        return None


def has_ended(known: EngineProcess) -> bool:
    """Return whether the process `known` has certainly ended: this is the same boot and namespace
    of process ids, and no process has this id and start time. False if that cannot be seen."""
    try:
        if _here() != (known.boot, known.namespace):
            return False
        return _started(known.pid) != known.started
    except OSError:
        return False


def engine_process(prefix: str, ours: str, domain: int, name: str) -> EngineProcess | None:
    """Return the process behind a DDS participant (`prefix`: its GUID prefix in hex) if it
    certainly runs on this computer, else None. `ours`: the GUID prefix of this process; `domain`:
    the ROS domain; `name`: the name of the engine. Fast DDS puts two bytes of the host and the low
    two bytes of the process id into the prefix. Containers on one network share the host bytes and
    have process ids of their own, so the process must also hold a port of that domain and have the
    engine's name in its command line. For every other middleware the result is None."""
    if len(prefix) < 24 or prefix[:8] != ours[:8] or not prefix.startswith(_FAST_DDS):
        return None
    low = int.from_bytes(bytes.fromhex(prefix[8:12]), "little")
    try:
        found = [
            pid
            for pid in _pids()
            if pid & 0xFFFF == low and _is_called(pid, name) and _speaks_dds(pid, domain)
        ]
    except OSError:
        return None
    return process(found[0]) if len(found) == 1 else None


def indexes_again(known: EngineProcess) -> bool | None:
    """Return whether the process of an engine reads its folders of files again while it runs; None
    if that cannot be known, as on another computer or for another program than the engine's own
    node."""
    try:
        words = command_line(known.pid)
        is_same = _here() == (known.boot, known.namespace) and _started(known.pid) == known.started
    except OSError:
        return None
    return indexes_by(words) if is_same else None


def indexes_by(words: Sequence[str]) -> bool | None:
    """Return whether an engine with this command line (split at its arguments) reads its folders of
    files again while it runs. False for an emulated engine, which can be asked at any time; None
    for an unknown program."""
    if is_engine_node(words):
        return indexing_rate(words) != "0"
    return False if _is_emulator(words) else None


def command_line(pid: int) -> list[str]:
    """Return the arguments with which the process `pid` was started, the program first. Raise
    OSError if the kernel does not show them."""
    return (_PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")


def is_engine_node(words: Sequence[str]) -> bool:
    """Return whether a command line (split at its arguments) starts the engine's own node, directly
    or as the argument of another program."""
    return any(Path(word).name == _PROGRAM for word in words[:2])


def _is_emulator(words: Sequence[str]) -> bool:
    """Return whether a command line (split at its arguments) starts the engine of an emulated
    robot, which is a command of this program."""
    programs = {"action_assistant", "action-assistant"}
    return any(
        command == _EMULATOR and Path(program).name in programs
        for program, command in itertools.pairwise(words[:6])
    )


def indexing_rate(words: Sequence[str]) -> str:
    """Return the indexing rate in a command line of the engine's node: "0" for an engine that
    indexes once, "" if the option is absent, so that it indexes every 2 s."""
    rate = argument(words, "--indexing-rate")
    return "0" if rate.isdecimal() and int(rate) == 0 else rate


def argument(words: Sequence[str], option: str) -> str:
    """Return the value of an option in a command line of the engine's node (split at its
    arguments); "" without it. The value is the next argument or follows `=`; as the node does,
    accept an abbreviated option."""
    for word, following in zip(words, [*words[1:], ""], strict=True):
        name, equals, value = word.partition("=")
        if len(name) > len("--") and name.startswith("--") and option.startswith(name):
            return value if equals else following
    return ""


def threads(known: EngineProcess) -> frozenset[Thread] | None:
    """Return the threads of the process of an engine's own node; None if they cannot be known. That
    is so if the process has ended, is on another computer, or runs another program, which may not
    begin a thread for each action; also if a thread ends during each attempt, since the kernel's
    list is incomplete then."""
    folder = _PROC / str(known.pid)
    try:
        program = command_line(known.pid)[0]
        if _here() != (known.boot, known.namespace) or Path(program).name != _PROGRAM:
            return None
        found = next(filter(None, (_listed(folder / "task") for _ in range(_LOOKS))), None)
        return found if _started(known.pid) == known.started else None
    except OSError:
        return None


def _listed(tasks: Path) -> frozenset[Thread] | None:
    """Return the threads in a `task` folder of /proc; None if one ended meanwhile, or the kernel
    counts more threads than it has listed."""
    found = {each.name: _began(each) for each in tasks.iterdir()}
    listed = [Thread(int(name), began) for name, began in found.items() if began is not None]
    counted = int(_fields(tasks.parent)[_NUM_THREADS])
    return frozenset(listed) if len(listed) == len(found) == counted else None


def _here() -> tuple[str, str]:
    boot = (_PROC / "sys/kernel/random/boot_id").read_text().strip()
    return boot, str((_PROC / "self/ns/pid").readlink())


def _started(pid: int) -> int | None:
    """Return when the process `pid` began, in clock ticks after boot; None if it has ended, even if
    its parent has not reaped it yet."""
    folder = _PROC / str(pid)
    try:
        fields = _fields(folder)
        is_dead = fields[0] in "ZX" and len(list((folder / "task").iterdir())) <= 1
    except (FileNotFoundError, ProcessLookupError):
        return None
    return None if is_dead else int(fields[19])


def _began(folder: Path) -> int | None:
    """Return when a thread began, in clock ticks after boot; None when it has ended. `folder`: of
    the thread in /proc."""
    try:
        return int(_fields(folder)[19])
    except (FileNotFoundError, ProcessLookupError):
        return None


def _fields(folder: Path) -> list[str]:
    """Return the fields of a `stat` file in a /proc folder, from the third one, the state, on."""
    return (folder / "stat").read_text().rpartition(")")[2].split()


def _pids() -> Iterator[int]:
    return (int(each.name) for each in _PROC.iterdir() if each.name.isdigit())


def _is_called(pid: int, name: str) -> bool:
    """Return whether `name` stands in the command line of the process `pid`, as an argument of its
    own or between `=` or commas."""
    try:
        line = (_PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return False
    return name in re.split(r"[\0=,]", line)


def _speaks_dds(pid: int, domain: int) -> bool:
    """Return whether the process `pid` has a UDP socket on a DDS port of this domain; False if that
    cannot be seen."""
    folder = _PROC / str(pid)
    try:
        inodes = {_socket(each) for each in (folder / "fd").iterdir()}
        rows = [
            line.split()
            for name in ("udp", "udp6")
            for line in (folder / "net" / name).read_text().splitlines()[1:]
        ]
    except OSError:
        return False
    first = _FIRST_PORT + _PORTS * domain
    return any(
        row[9] in inodes and first <= int(row[1].rpartition(":")[2], 16) < first + _PORTS
        for row in rows
    )


def _socket(descriptor: Path) -> str:
    try:
        target = str(descriptor.readlink())
    except OSError:  # closed meanwhile
        return ""
    return target[8:-1] if target.startswith("socket:[") else ""
