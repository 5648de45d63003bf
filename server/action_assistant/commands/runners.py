"""The runners of a server, as commands ask them: one, or several sites of which each has its own robots."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypedDict
from urllib.parse import unquote

from action_assistant.commands.answers import decoded
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.settings import Site

if TYPE_CHECKING:
    import httpx

_SIMULATOR: Final = "simulator"  # each runner has one
_UNKNOWN: Final = 404
_TWINS_S: Final = 2.0  # in which other sites may still say that they have a robot of this name, too


class _Named(TypedDict):
    name: str


class _Identified(TypedDict):
    id: str


class _Queue(TypedDict):
    entries: list[_Identified]


class Heard(NamedTuple):
    """The answer of one site, or the error for which there is none."""

    site: Site
    answer: "httpx.Response | None"
    error: RequestRefused | CannotStart | None

    @property
    def status(self) -> int:
        """Return the status of a refusal, else 0."""
        return self.error.status or 0 if isinstance(self.error, RequestRefused) else 0


class Gathered(NamedTuple):
    """The lists of all sites that answer. `code`: the exit code, 1 if a site is missing."""

    answers: "list[tuple[Site, httpx.Response]]"
    code: int

    def json(self, name: str = "") -> list[Any]:
        """Return the entries of all lists; of several, each with the name of its `site`. `name`: of the
        list in each answer, which is the whole answer without it."""
        return [
            {**entry, "site": site.name} if site.name else entry
            for site, answer in self.answers
            for entry in (answer.json()[name] if name else answer.json())
        ]


class Runners:
    """Sends requests to the runners of one server.

    A request about a run, a robot, a repeat or an entry of the queue goes to the site that has it, a
    start to that of its robots, anything else to the first site. `send`: sends a request to a URL.
    """

    def __init__(self, send: "Callable[..., httpx.Response]", sites: tuple[Site, ...]) -> None:
        self._send = send
        self.sites: Final = sites
        self._homes: dict[str, Site] = {}

    @property
    def has_several(self) -> bool:
        return len(self.sites) > 1

    def at(self, site: Site) -> "Runners":
        """Return the runner of one site alone."""
        return Runners(self._send, (site,))

    def named(self, name: str | None) -> Site:
        """Return the site with a name; the first one without a name. Raise RequestRefused if there is
        none."""
        if name is None:
            return self.sites[0]
        for site in self.sites:
            if site.name.casefold() == name.casefold():
                return site
        names = ", ".join(each.name for each in self.sites if each.name) or "none"
        raise RequestRefused(f"There is no site called {name!r}. There are: {names}.")

    def of_robot(self, robot: str) -> Site:
        """Return the site of a robot; the first one for the simulator, and for an unknown robot. Raise
        RequestRefused if several have it, CannotStart if that is not known."""
        return (self._of_robots([robot]) if self.has_several else None) or self.sites[0]

    def request(self, method: str, path: str, **body: Any) -> "httpx.Response":
        """Send a request to the site that it is meant for. Raise RequestRefused if it is refused, or
        means robots of two sites; CannotStart if nobody answers."""
        site = self.sites[0]
        if self.has_several:
            site = self._meant(method, path, body.get("json")) or site
        return self._send(method, site.url + path, **body)

    def each(self, method: str, path: str, **body: Any) -> list[Heard]:
        """Send a request to all sites at once, so that none delays another, and return what each has
        answered."""

        def ask(site: Site) -> Heard:
            return self._heard(site, method, path, **body)

        if not self.has_several:
            return [ask(self.sites[0])]
        with ThreadPoolExecutor(len(self.sites)) as pool:
            return list(pool.map(ask, self.sites))

    def _heard(
        self, site: Site, method: str, path: str, kind: type[Any] | None = None, **body: Any
    ) -> Heard:
        try:
            answer = self._send(method, site.url + path, **body)
            if kind is not None:
                decoded(answer, kind)
            return Heard(site, answer, None)
        except (RequestRefused, CannotStart) as error:
            return Heard(site, None, error)

    def _answers(self, path: str, kind: type[Any]) -> SimpleQueue[Heard]:
        """Get a path from all sites at once, and return the queue into which each puts its answer, so
        that nobody waits for a site that hangs. An answer that is not of this kind is none."""
        answers: SimpleQueue[Heard] = SimpleQueue()

        def ask(site: Site) -> None:
            heard = Heard(site, None, CannotStart(f"{site.url} could not be asked."))
            try:
                heard = self._heard(site, "GET", path, kind)
            finally:
                answers.put(heard)

        for site in self.sites:
            Thread(target=ask, args=(site,), daemon=True).start()
        return answers

    def tell(
        self, method: str, path: str, *, gone: frozenset[int] = frozenset(), **body: Any
    ) -> None:
        """Send a request to all sites. `gone`: the statuses of refusals that are as good. Raise the
        error of the first site that did not take it, with the names of all such sites; others have
        taken it."""
        heard = self.each(method, path, **body)
        failed = [each for each in heard if each.error is not None and each.status not in gone]
        if failed:
            raise self._named(failed)

    def gathered(self, path: str, **body: Any) -> "Gathered":
        """Get a list from all sites. Those that do not answer are told on standard error. Raise the
        error of a site if none answers."""
        heard = self.each("GET", path, **body)
        failed = [each for each in heard if each.error is not None]
        if len(failed) == len(heard):
            raise self._named(failed)
        for each in failed:
            print(
                one_line(f"{each.site.name} does not answer, and is left out: {each.error}"),
                file=sys.stderr,
            )
        answers = [(each.site, each.answer) for each in heard if each.answer is not None]
        return Gathered(answers, 1 if failed else 0)

    def robots_elsewhere(self, name: str, site: Site) -> None:
        """Raise RequestRefused if a site other than `site` has a robot of this name, or does not say
        so: a start by its name could move the wrong robot."""
        for heard in self.each("GET", "/api/robots") if self.has_several else ():
            if heard.site == site:
                continue
            if heard.answer is None:
                raise RequestRefused(
                    f"{heard.site.name} does not say its robots ({heard.error}), and one of them may be "
                    f"called {name} as well. Register it when {heard.site.name} answers."
                )
            if name in _names(heard.answer):
                raise RequestRefused(
                    f"{name} is registered at {heard.site.name}: the name of a robot is unique over all "
                    "sites."
                )

    def _named(self, failed: list[Heard]) -> RequestRefused | CannotStart:
        """Return one error for sites that failed."""
        first = failed[0].error
        if not self.has_several and first is not None:
            return first
        said = " ".join(f"{each.site.name}: {each.error}" for each in failed)
        if isinstance(first, RequestRefused):
            return RequestRefused(said, first.status)
        return CannotStart(said)

    def _meant(self, method: str, path: str, sent: Any) -> Site | None:
        """Return the site that a request is meant for; None if each will do."""
        match path.partition("?")[0].split("/")[2:]:
            case ["runs", run, *_]:
                return self._having(f"/api/runs/{run}")
            case ["repeats", repeat, *_]:
                return self._having(f"/api/repeats/{repeat}")
            case ["robots", robot, *_] | ["queue", "robots", robot, *_]:
                return self._of_robots([unquote(robot)])
            case ["queue", entry, *_]:
                return self._having(
                    "/api/queue",
                    lambda queue: any(each["id"] == entry for each in queue["entries"]),
                )
            case ["runs" | "queue" | "groups" | "preflight" | "repeats" | "asked_inputs"]:
                return self._of_start(sent) if method == "POST" else None
        return None

    def _of_start(self, sent: Mapping[str, Any]) -> Site | None:
        """Return the site of the robots that a start names, else that of the run that it continues."""
        start = sent.get("start", sent)
        if site := self._of_robots([*_engines(sent), *_engines(start)]):
            return site
        earlier = start.get("from", {}).get("run")
        return self._having(f"/api/runs/{earlier}") if earlier else None

    def _having(self, path: str, holds: Callable[[Any], bool] = lambda _: True) -> Site | None:
        """Return the site at which a GET of `path` is answered with what `holds` accepts; None if no
        site has it. Raise CannotStart if none of those that answer has it."""
        if path in self._homes:
            return self._homes[path]
        silent = []
        is_queue = path == "/api/queue"
        answers = self._answers(path, _Queue if is_queue else _Identified)
        for _ in self.sites:
            heard = answers.get()
            if heard.answer is not None and holds(heard.answer.json()):
                if not is_queue:
                    self._homes[path] = heard.site
                return heard.site
            if heard.error is not None and heard.status != _UNKNOWN:
                silent.append(heard)
        if silent:
            raise self._named(silent)
        return None

    def _of_robots(self, robots: Iterable[str]) -> Site | None:
        """Return the site of robots; None if no site has them. Raise RequestRefused if they are of
        several sites, CannotStart if that is not known."""
        wanted = {each for each in robots if each != _SIMULATOR}
        if not wanted:
            return None
        answers = self._answers("/api/robots", list[_Named])
        homes: dict[str, list[Site]] = {robot: [] for robot in sorted(wanted)}
        heard: list[Heard] = []
        with suppress(Empty):
            while len(heard) < len(self.sites):
                heard.append(answers.get(timeout=_TWINS_S if all(homes.values()) else None))
                named = {each.site: _names(each.answer) for each in heard if each.answer}
                for robot in homes:
                    homes[robot] = [site for site in self.sites if robot in named.get(site, ())]
        silent = [each for each in heard if each.error is not None]
        if silent and not all(homes.values()):
            raise self._named(silent)
        found = {site for each in homes.values() for site in each}
        if len(found) > 1:
            raise RequestRefused(_of_several(homes))
        return next(iter(found), None)


def _of_several(homes: Mapping[str, list[Site]]) -> str:
    """Return a sentence that refuses a start on robots of several sites. `homes`: where each is."""
    for robot, sites in homes.items():
        if len(sites) > 1:
            return (
                f"{robot} is registered at {' and at '.join(site.name for site in sites)}, so it is not "
                f"known which is meant. Take one away: robots remove {robot} --site {sites[-1].name!r}."
            )
    at = "; ".join(
        f"{robot} at {' and '.join(site.name for site in sites)}"
        for robot, sites in homes.items()
        if sites
    )
    return f"One runner leads all robots of a run, and these are of several sites: {at}."


def _engines(order: Mapping[str, Any]) -> Iterator[str]:
    """Yield the engines that a start names."""
    if order.get("engine") not in {None, "conducted"}:
        yield order["engine"]
    yield from order.get("engines", ())
    yield from order.get("robots", {}).values()


def _names(answer: "httpx.Response") -> set[str]:
    return {each["name"] for each in answer.json()}
