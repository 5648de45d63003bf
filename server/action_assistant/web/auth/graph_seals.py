"""Rules of graphs, sealed by the editor, so that a runner can verify by itself who may see a run.

The seal is an HMAC under a key that both processes derive from the token of the server. A `Sight`
travels with a start. A `Statement` has the rules of all graphs; the editor writes it into the data
folder, and an owner's page or command brings it to a runner that has a data folder of its own.
"""

import hashlib
import hmac
import logging
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final, TypeVar

import msgspec
from msgspec.structs import replace

from action_assistant.errors import BadInput, Unavailable
from action_assistant.kit.retrying_thread import RetryingThread
from action_assistant.private_files import FileState, read_logged, state_of, write_json
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.keys import Keys

log: Final = logging.getLogger(__name__)

FILE: Final = "graph-rules.json"
_LABEL: Final = b"action-assistant graph rules\0"


class Sight(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rules of a version at one time: a run of it is for those who may see all its graphs.

    `digest`: the tree digest of the version, or its digest if it has none. `graphs`: the ids of the
    graph and of all graphs inside. `rules`: the rule that counts for each of them, in their order.
    `at`: microseconds since 1970.
    """

    version: str
    digest: str
    graphs: tuple[str, ...]
    rules: tuple[Rule, ...]
    at: int
    seal: str = ""


class Statement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rules of all graphs at one time, also of deleted graphs, and of drafts, for which that of
    their origin counts. `graphs`: the index in `rules` of the rule that counts, by the id of the
    graph; graphs that are left out are open to everybody. `at`: microseconds since 1970; a later
    statement has a greater one."""

    at: int
    rules: tuple[Rule, ...]
    graphs: dict[str, int]
    seal: str = ""

    def rule_of(self, graph: str) -> Rule:
        """Return the rule that counts for the graph with this id."""
        index = self.graphs.get(graph)
        return OPEN if index is None else self.rules[index]


_Sealed = TypeVar("_Sealed", Sight, Statement)


class GraphSeals:
    """Seals sights and statements, and verifies seals."""

    def __init__(self, keys: Keys) -> None:
        self._key: Final = hashlib.sha256(_LABEL + keys.token.encode()).digest()

    def sealed(self, what: _Sealed) -> _Sealed:
        """Return the value with its seal."""
        return replace(what, seal=self._seal(what))

    def holds(self, what: Sight | Statement) -> bool:
        """Return whether a value has the seal of this server. A statement that names a rule which it
        does not have holds not."""
        if isinstance(what, Statement) and not all(
            0 <= index < len(what.rules) for index in what.graphs.values()
        ):
            return False
        given = what.seal.encode(errors="replace")
        return hmac.compare_digest(given, self._seal(what).encode())

    def _seal(self, what: Sight | Statement) -> str:
        kind = type(what).__name__.encode()
        content = msgspec.json.encode(replace(what, seal=""), order="sorted")
        return hmac.new(self._key, kind + b"\0" + content, hashlib.sha256).hexdigest()


def statement_of(counting: Mapping[str, Rule], after: Statement | None) -> Statement:
    """Return the unsealed statement of the rules that count, by the ids of graphs, later than the
    statement `after`."""
    rules = tuple(dict.fromkeys(rule for rule in counting.values() if rule != OPEN))
    index = {rule: number for number, rule in enumerate(rules)}
    graphs = {graph: index[rule] for graph, rule in counting.items() if rule != OPEN}
    at = max(time.time_ns() // 1000, 0 if after is None else after.at + 1)
    return Statement(at, rules, graphs)


class RulesFile:
    """Keeps the newest statement in the data folder, for both processes. While the file cannot be
    read, or its seal is wrong, the last good statement counts."""

    def __init__(self, data: Path, keys: Keys) -> None:
        self._path = data / FILE
        self._seals = GraphSeals(keys)
        self._newest: Statement | None = None
        self._read: FileState | None = None
        self._writing = threading.Lock()
        self._taking = threading.Lock()
        self._later: Final = RetryingThread(self._write_now, "graph-rules")
        self._unwritten = False

    def newest(self) -> Statement | None:
        """Return the newest statement; None if there was never one."""
        try:
            state = state_of(self._path)
            if state != self._read:
                stored = read_logged(self._path, Statement)
                self._read = state
                if stored is not None:
                    self._take(stored)
        except OSError:  # not there, or the disk is gone: what is known still counts
            pass
        except BadInput as error:
            log.error("%s cannot be read: %s", self._path, error.detail)
        return self._newest

    def store(self, statement: Statement) -> None:
        """Store a statement unless a later one is known. It holds at once. Raise BadInput for a
        wrong seal. Raise Unavailable if the file cannot be written; it is tried again until this
        process ends."""
        self.newest()
        if not self._take(statement):
            return
        with self._writing:
            self._unwritten = True
            try:
                self._replace()
            except OSError as error:
                self._later.start()
                raise Unavailable(
                    f"It holds here and now, but could not be written to {self._path.parent}: "
                    f"{error.strerror}. It is tried again."
                ) from error

    def _take(self, statement: Statement) -> bool:
        """Return whether a statement is later than the known one, and remember it if so. Raise
        BadInput for a wrong seal."""
        if not self._seals.holds(statement):
            raise BadInput("The rules of graphs do not have the seal of this server.")
        with self._taking:  # one may be stored while the file is read
            if self._newest is not None and statement.at <= self._newest.at:
                return False
            self._newest = statement
        return True

    def _write_now(self) -> bool:
        """Return whether the newest statement is written after another attempt."""
        with self._writing:
            try:
                if self._unwritten:
                    self._replace()
            except OSError:
                return False
        return True

    def _replace(self) -> None:
        write_json(self._path, self._newest, Statement)
        self._unwritten = False
