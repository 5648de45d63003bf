"""Decides who may see a run, by the rules of its graphs, which the runner verifies without the editor.

The rules come with the statement in the data folder, and with the sealed sights of starts: of both the
newest counts for each graph. A run that somebody may not see shows its robot, its state,
who started it, and Stop.
"""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import anyio
import msgspec
from anyio import to_thread

from action_assistant.errors import BadInput, Conflict, Forbidden, Unavailable
from action_assistant.kit.clock import ClockUs, utc_us
from action_assistant.private_files import (
    DamagedFile,
    log_unreadable,
    make_folder,
    read_json,
    replace_file,
)
from action_assistant.random_ids import random_id
from action_assistant.runner.runs.events import Requested, RunSubgraph
from action_assistant.runner.runs.run import Run
from action_assistant.web.auth import graph_seals
from action_assistant.web.auth.graph_rules import OPEN, Rule, combined, may_see
from action_assistant.web.auth.graph_seals import GraphSeals, RulesFile, Sight, Statement
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.roles import OWNER

log: Final = logging.getLogger(__name__)

FILE: Final = "graph-sights.json"
#: Stands for the name of a graph that the reader may not see.
HIDDEN_NAME: Final = "a graph that you may not see"
HIDDEN_RUN: Final = (
    "This is a run of a graph that you may not see. You may stop it, and nothing else."
)
HIDDEN_GRAPH: Final = "You may not see this graph, or a graph inside of it."
HIDDEN_ON_ROBOT: Final = "This may hold graphs that you may not see."
_SKEW_US: Final = 60_000_000  # by which the clock of the editor may be ahead
_MOST_LEARNED: Final = 20_000  # graphs whose rules came with starts, since the newest statement
_MOST_RUNS: Final = 10_000  # that are remembered
_MOST_KEPT: Final = 1_000  # identities of which it is remembered what they may not see


class RunGraphs(msgspec.Struct, frozen=True):
    """The facts that decide who may see a run: the id of the person who started it, the ids of its
    graph and of all graphs inside, and whether it was started without a sight while there were
    rules. Then only its starter and owners see it."""

    author: str
    graphs: tuple[str, ...]
    unsighted: bool = False


class Unseen(msgspec.Struct, frozen=True):
    """The graphs that one person may not see. `everything`: the rules cannot be read, so that only
    own runs are shown."""

    person: str
    graphs: frozenset[str] = frozenset()
    everything: bool = False

    @property
    def is_some(self) -> bool:
        """Return whether there is a graph that the person may not see."""
        return self.everything or bool(self.graphs)

    def hides(self, run: RunGraphs) -> bool:
        """Return whether the person may not see a run."""
        if self.person and run.author == self.person:
            return False
        return self.everything or run.unsighted or not self.graphs.isdisjoint(run.graphs)


def sees_all() -> None:
    """Return what somebody who sees everything may not see."""


def names_seen(
    names: Mapping[str, list[str]], unseen: Callable[[], Unseen | None]
) -> dict[str, list[str]]:
    """Return the names of graphs that others started and that are being stopped, by robot; none is
    named to a person who may not see some graph, since nobody knows what these are. If `unseen` fails,
    none is named: the Stop has begun, and is answered."""
    try:
        now = unseen()
    except Exception:  # the sender would be told that nothing was stopped
        log.exception("it cannot be read who may see the graphs that are being stopped")
        now = Unseen("", everything=True)
    if now is None or not now.is_some:
        return dict(names)
    return {robot: [HIDDEN_NAME] * len(graphs) for robot, graphs in names.items()}


def run_graphs(run: Run) -> RunGraphs:
    """Return the facts about a run that decide who may see it."""
    return RunGraphs(run.author.id, _ids(run.graph, *run.inside), run.unsighted)


def graphs_inside(sight: Sight | None, subgraphs: tuple[RunSubgraph, ...]) -> tuple[str, ...]:
    """Return the ids of graphs that a run shows beside its own one, each once."""
    return _ids(*(each.graph for each in subgraphs), *(sight.graphs if sight is not None else ()))


def graphs_requested(first: Requested) -> RunGraphs:
    """Return the facts about a run by its first event."""
    inside = graphs_inside(first.sight, first.subgraphs)
    return RunGraphs(first.author.id, _ids(first.graph, *inside), first.unsighted)


def _ids(*graphs: str | None) -> tuple[str, ...]:
    return tuple(dict.fromkeys(each for each in graphs if each))


class _Learned(msgspec.Struct, frozen=True, array_like=True):
    """The rule of a graph that came with a start, and when it counted."""

    at: int
    rule: Rule


class RunSight:
    """Knows who may see which runs. Without a data folder there are no rules."""

    def __init__(
        self, data: Path | None = None, keys: Keys | None = None, clock_us: ClockUs = utc_us
    ) -> None:
        self._clock_us = clock_us
        self._storing = anyio.Lock()
        self._rules = None if data is None or keys is None else RulesFile(data, keys)
        self._seals = None if keys is None else GraphSeals(keys)
        self._data = data
        self._learned: dict[str, _Learned] = {}
        self._is_unread = False
        self._counted: tuple[Statement | None, dict[str, Rule]] | None = None
        self._unseen: dict[tuple[str, frozenset[str]], Unseen] = {}
        self._of_runs: dict[str, RunGraphs] = {}
        if data is not None:
            self._read_learned(data / FILE)

    # --- what somebody may see ----------------------------------------------------------------

    def unseen(self, identity: Identity | None) -> Unseen | None:
        """Return the graphs that an identity may not see; None if it sees everything, as owners do,
        and as everybody does while there are no rules. An identity of None has ended."""
        if identity is not None and identity.person.role == OWNER:
            return None
        counting = self._counting()
        if not counting and not self._is_dark():
            return None
        if identity is None:
            return Unseen("", everything=True)
        if self._is_dark():
            return Unseen(identity.person.id, everything=True)
        key = (identity.person.id, identity.groups)
        if key not in self._unseen:
            if len(self._unseen) >= _MOST_KEPT:
                self._unseen.clear()
            refused = {rule for rule in set(counting.values()) if not may_see(rule, identity)}
            graphs = frozenset(graph for graph, rule in counting.items() if rule in refused)
            self._unseen[key] = Unseen(identity.person.id, graphs)
        return self._unseen[key]

    def hides(self, run: RunGraphs, identity: Identity | None) -> bool:
        """Return whether an identity may not see a run."""
        unseen = self.unseen(identity)
        return unseen is not None and unseen.hides(run)

    def known(self, run: str) -> RunGraphs | None:
        """Return what was remembered of a run; None for any other id."""
        return self._of_runs.get(run)

    def remember(self, run: str, graphs: RunGraphs) -> None:
        """Remember the facts about a run that decide who may see it. They never change."""
        if len(self._of_runs) >= _MOST_RUNS:
            del self._of_runs[next(iter(self._of_runs))]
        self._of_runs[run] = graphs

    @property
    def has_rules(self) -> bool:
        """Return whether any graph has a rule. Then texts that several people read name no graphs of
        others."""
        return bool(self._counting()) or self._is_dark()

    def require_graphs(self, identity: Identity, *graphs: str | None) -> None:
        """Raise Forbidden if an identity may not see one of these graphs."""
        unseen = self.unseen(identity)
        if unseen is not None and not unseen.graphs.isdisjoint(_ids(*graphs)):
            raise Forbidden(HIDDEN_GRAPH)

    def _counting(self) -> dict[str, Rule]:
        """Return the rules other than OPEN that count now, by the ids of graphs."""
        newest = None if self._rules is None else self._rules.newest()
        if self._counted is None or self._counted[0] is not newest:
            since = 0 if newest is None else newest.at
            rules = (
                {} if newest is None else {graph: newest.rule_of(graph) for graph in newest.graphs}
            )
            for graph, each in self._learned.items():
                if each.at > since:
                    known = rules.get(graph, OPEN)
                    rules[graph] = (
                        combined((known, each.rule)) if self._is_doubted(each) else each.rule
                    )
            counting = {graph: rule for graph, rule in rules.items() if rule != OPEN}
            self._counted = newest, counting
            self._unseen.clear()
        return self._counted[1]

    def _is_dark(self) -> bool:
        """Return whether there are rules that could not be read since this process began."""
        if self._is_unread:
            return True
        if self._rules is None or self._rules.newest() is not None:
            return False
        return self._data is not None and _may_exist(self._data / graph_seals.FILE)

    # --- starts ---------------------------------------------------------------------------------

    async def accept(
        self, sight: Sight | None, version: str, digests: tuple[str | None, ...], identity: Identity
    ) -> None:
        """Verify the sight (the sealed rules of a version's graphs) that came with the version, and
        remember its rules. Do nothing if `sight` is None. `digests`: the digests of the version
        that was sent; the sight must name one of them. Raise BadInput for a wrong seal, Conflict
        for the sight of another version, Forbidden if the identity may not see one of the graphs,
        Unavailable if the rules cannot be stored."""
        if sight is None:
            return
        where: dict[str, object] = {"path": "/sight"}
        if self._seals is None or not self._seals.holds(sight) or not _is_whole(sight):
            raise BadInput("The sight does not have the seal of this server.", where=where)
        if sight.version != version or sight.digest not in digests:
            raise Conflict("The sight belongs to another version.", where=where)
        await self._learn(sight)
        self.require_graphs(identity, *sight.graphs)

    async def store(self, statement: Statement) -> None:
        """Store a newer statement. Raise BadInput for a wrong seal, Unavailable if it cannot be
        written: it holds here then until this process ends."""
        if self._rules is not None:
            await to_thread.run_sync(self._rules.store, statement)

    def _is_doubted(self, learned: _Learned) -> bool:
        """Return whether a rule is of the future: a clock was set back, and nothing says whether it is
        newer than others. Then only those see the graph whom all of them let."""
        return learned.at > self._clock_us() + _SKEW_US

    async def _learn(self, sight: Sight) -> None:
        """Remember the rules of a sight that are newer than the known ones. Equal rules are
        remembered with the newer time, so that an older sight that is sent again later does not
        replace them."""
        counting = self._counting()
        newest = None if self._rules is None else self._rules.newest()
        since = 0 if newest is None else newest.at
        kept = {graph: each for graph, each in self._learned.items() if each.at > since}
        news: dict[str, _Learned] = {}
        for graph, rule in zip(sight.graphs, sight.rules, strict=True):
            known = kept.get(graph)
            if sight.at > max(since, 0 if known is None else known.at):
                if known is not None or rule != OPEN or graph in counting:
                    news[graph] = _Learned(sight.at, rule)
            elif sight.at > since and known is not None and self._is_doubted(known):
                news[graph] = _Learned(known.at, combined((known.rule, rule)))
        if not news:
            return
        self._learned = _within_bounds(kept | news)
        self._counted = None
        if self._data is None or self._is_unread:  # what was there is kept, and hides everything
            return
        try:
            async with self._storing:  # of two that store at once the older one must not be last
                await to_thread.run_sync(_write, self._data / FILE, dict(self._learned))
        except OSError as error:
            raise Unavailable(
                f"The rules of the graph could not be stored, so nothing was started: {error.strerror}."
            ) from error

    def _read_learned(self, path: Path) -> None:
        try:
            self._learned = read_json(path, dict[str, _Learned])
        except FileNotFoundError:
            pass
        except (OSError, DamagedFile) as error:
            log_unreadable(path, error)
            self._is_unread = True


def _may_exist(path: Path) -> bool:
    """Return whether a file is there, or may be, since the disk does not say."""
    try:
        path.stat()
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return True


def _within_bounds(learned: dict[str, _Learned]) -> dict[str, _Learned]:
    """Return the rules without the oldest ones that let everybody see a graph, if they are too many. Raise
    Unavailable if they are too many without these: none that hides a graph is forgotten."""
    too_many = len(learned) - _MOST_LEARNED
    if too_many <= 0:
        return learned
    wide = sorted((each.at, graph) for graph, each in learned.items() if each.rule == OPEN)
    if len(wide) < too_many:
        raise Unavailable(
            "This runner has learned the rules of too many graphs by starts, so nothing was started. An "
            "owner's page or command can bring it all rules."
        )
    forgotten = {graph for _, graph in wide[:too_many]}
    return {graph: each for graph, each in learned.items() if graph not in forgotten}


def _is_whole(sight: Sight) -> bool:
    return len(sight.graphs) == len(sight.rules)


def _write(path: Path, learned: Mapping[str, _Learned]) -> None:
    make_folder(path.parent)
    part = path.with_name(f"{path.name}.{random_id()}.part")
    replace_file(path, msgspec.json.encode(learned), part=part)


#: Shows all runs to everybody: for tests and programs without a data folder.
NO_RULES: Final = RunSight()
