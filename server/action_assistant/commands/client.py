"""The client by which commands talk to a running server: with the token, over HTTP or TLS."""

import argparse
import contextlib
import os
import re
import socket
import ssl
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar
from urllib.parse import urlsplit

import msgspec

from action_assistant import paths, settings
from action_assistant.commands.answers import decoded, kind_of, sentence
from action_assistant.commands.runners import Runners
from action_assistant.commands.stored_tokens import StoredToken, server_key, stored_token
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.logs import say
from action_assistant.settings import Site
from action_assistant.sites import kept_sites, port_of
from action_assistant.system.served_addresses import ServedAddress, served_address
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.token_text import token_id
from action_assistant.web.network.certificate import Certificate

if TYPE_CHECKING:  # slow to load, and most commands do not need it
    import httpx


T = TypeVar("T")

_TOKEN: Final = "ACTION_ASSISTANT_TOKEN"
_EDITOR_S: Final = 3.0  # for which a Stop waits for the editor, which only says where the runner is
_EDITOR_SILENT: Final = "The editor does not say where its runners are."
#: The form of a graph's id.
_MADE_ID: Final = re.compile(r"[A-Za-z0-9]{12}")


def command(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
    name: str,
    text: str,
    example: str,
) -> argparse.ArgumentParser:
    """Add a sub-command that needs a running server, and return its parser. `text`: the help;
    `example`: its arguments in an example."""
    parser = commands.add_parser(name, help=text, description=text)
    add_server(parser, example)
    return parser


def add_server(parser: argparse.ArgumentParser, example: str) -> None:
    """Add the options by which a command finds its server, and an example (its arguments) to the
    help."""
    parser.epilog = f"example: {parser.prog} {example}".rstrip()
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--url",
        "--server",
        metavar="URL",
        help="of the editor, or the public address of a server (default: that of the data folder)",
    )
    which.add_argument(
        "--port", type=settings.port_number, metavar="N", help="of an editor on this computer"
    )
    parser.add_argument(
        "--data",
        type=Path,
        default=paths.data(),
        action=_NamedFolder,
        metavar="DIR",
        help="of the server, or that holds a token for it",
    )
    parser.set_defaults(folder_is_named=False)


class _NamedFolder(argparse.Action):
    """Stores `--data`, and that it was given."""

    def __call__(
        self, parser: argparse.ArgumentParser, found: argparse.Namespace, value: Any, *_: object
    ) -> None:
        found.data = value
        found.folder_is_named = True


def names_server(options: argparse.Namespace) -> bool:
    """Return whether the options of a command name its server by an address."""
    return options.url is not None or options.port is not None


class Known(NamedTuple):
    """The runners of a server, as far as a command knows them. `further`: a sentence about runners
    that a Stop of everything does not reach; `is_in_doubt`: this server may have such runners."""

    sites: tuple[Site, ...]
    further: str = ""
    is_in_doubt: bool = False


class Server:
    """A client of a running editor and its runners. `known`: all of them, if there are several;
    `no_editor`: why no request reaches an editor."""

    def __init__(
        self,
        editor: "httpx.Client",
        runner_url: str,
        no_editor: str = "",
        known: Known | None = None,
    ) -> None:
        self._client = editor
        self.known: Final = known or Known((Site("", runner_url),))
        self.runners = Runners(partial(request, editor), self.known.sites)
        self._no_editor = no_editor

    @property
    def url(self) -> str:
        """Return the URL of the editor without a final slash."""
        return str(self._client.base_url).rstrip("/")

    def editor(self, method: str, path: str, **body: Any) -> "httpx.Response":
        """Send a request to the editor, wait for the answer and return it. `body`: further
        arguments of httpx. Raise RequestRefused, with one sentence, if it is refused."""
        if self._no_editor:
            raise CannotStart(self._no_editor)
        return request(self._client, method, path, **body)

    def runner(self, method: str, path: str, **body: Any) -> "httpx.Response":
        """Send a request to the runner that it is meant for, wait for the answer and return it.
        `body`: further arguments of httpx. Raise RequestRefused, with one sentence, if it is refused."""
        return self.runners.request(method, path, **body)

    def at(self, site: Site) -> "Server":
        """Return a client of the editor and the runner of one site."""
        return Server(self._client, site.url, self._no_editor, Known((site,)))

    def graph_id(self, asked: str) -> str:
        """Return the id of the graph with the id or name `asked`. Raise RequestRefused unless
        exactly one graph matches."""
        graphs = self.editor("GET", "/api/graphs").json()
        if any(graph["id"] == asked for graph in graphs):
            return asked
        named = [graph["id"] for graph in graphs if graph["name"] == asked]
        if not named and _MADE_ID.fullmatch(asked):  # drafts stand in no list
            return str(self.editor("GET", f"/api/graphs/{asked}").json()["id"])
        if len(named) != 1:
            raise RequestRefused(
                f"No graph is called {asked!r}."
                if not named
                else f"{len(named)} graphs are called {asked!r}; name one by id: {', '.join(named)}."
            )
        found: str = named[0]
        return found


def request(client: "httpx.Client", method: str, path: str, **body: Any) -> "httpx.Response":
    """Send a request and return its answer. Raise RequestRefused, with one sentence, if it is
    refused; CannotStart if nobody answers."""
    import httpx

    try:
        answer = client.request(method, path, **body)
    except httpx.HTTPError as error:
        raise CannotStart(
            f"No answer from {error.request.url.copy_with(path='/', query=None, userinfo=b'')} ({error}). "
            "Is it running? Start it with `action-assistant serve`."
        ) from error
    if answer.is_error:
        raise RequestRefused(sentence(answer), answer.status_code, kind_of(answer))
    return answer


class _Found(NamedTuple):
    """The place of a server. `url`: of the editor, or of a runner that serves a folder alone;
    `runner`: of the runner, as far as the data folder says it. `supposed`: nobody has named the URL.
    """

    url: str
    runner: str | None
    supposed: bool
    no_editor: str = ""


def _found(
    options: argparse.Namespace, trust: ssl.SSLContext, *, without_editor: bool = False
) -> _Found:
    """Find the server that a command is meant for: that of its URL or port, else the one that serves
    its data folder, else what the environment names. `without_editor`: if nothing serves a folder that
    names several runners, its first one will do, since the others may live. Raise CannotStart if a
    data folder was named whose server is not known, so that no other server is asked."""
    from_environment = None if options.folder_is_named else os.environ.get("ACTION_ASSISTANT_URL")
    if named := options.url or (from_environment if options.port is None else None):
        return _Found(named, None, supposed=False)
    data = options.data.resolve()
    addresses = [served_address(data, "editor"), served_address(data, "runner")]
    editor, runner = (each if each is not None and each.lives else None for each in addresses)
    first = editor or runner
    if options.port is not None:
        if first is None or not options.folder_is_named:
            return _Found(_at_port(options.port, trust), None, supposed=True)
        if editor is None or urlsplit(editor.url).port != options.port:
            raise CannotStart(
                f"{data} is not served at port {options.port} but at {first.url}: leave --port out."
            )
    if first is not None:
        return _served(data, first, editor, runner)
    ended = next((each for each in addresses if each is not None), None)
    if ended is not None or (options.folder_is_named and _is_of_a_server(data)):
        last = f" The last one, at {ended.url}, was killed." if ended is not None else ""
        kept, unread = _kept(data) if without_editor else ((), "")
        if kept:
            no_editor = f"No editor serves {data} now."
            return _Found(kept[0].url, kept[0].url, supposed=True, no_editor=no_editor)
        raise CannotStart(
            f"No server serves {data} now, as far as the folder says, so nothing was sent to any "
            f"server.{last} Name one of an older version, or on another computer, with --port or "
            f"--url. {unread}".rstrip()
        )
    named = os.environ.get("ACTION_ASSISTANT_URL")
    url = named or _at_port(settings.port(), trust)
    return _Found(url, None, supposed=not named)


def _served(
    data: Path, first: ServedAddress, editor: ServedAddress | None, runner: ServedAddress | None
) -> _Found:
    """Return the place of the server that serves a folder. `first`: the editor if it lives, else the
    runner. Raise CannotStart if its address is not valid here."""
    if not all(each.is_here for each in (editor, runner) if each is not None):
        raise CannotStart(
            f"{data} is served at {first.url} in a container with a network of its own, or on another "
            "computer. Run the command there, or name the server with --url."
        )
    no_editor = "" if editor is not None else f"No editor serves {data} now."
    runner_url = None if runner is None else runner.url
    return _Found(first.url, runner_url, supposed=True, no_editor=no_editor)


def _is_of_a_server(data: Path) -> bool:
    """Return whether a folder is the data folder of a server, and not only one with a token."""
    return _is_of_an_editor(data) or (data / "runner.db").exists()


def _is_of_an_editor(data: Path) -> bool:
    """Return whether a folder has the journal of an editor, or says where it is."""
    return any((data / name).exists() for name in ("editor.db", "editor.database"))


def _kept(data: Path) -> tuple[tuple[Site, ...], str]:
    """Return the sites of a data folder, none with one runner, and why they cannot be read."""
    try:
        return kept_sites(data), ""
    except CannotStart as error:
        return (), str(error)


@contextmanager
def running(options: argparse.Namespace, *, without_editor: bool = False) -> Iterator[Server]:
    """Yield a client, with the token, of the server that the options name. `without_editor`: where
    the editor does not answer within 3 s, the runner is looked for at the port after it. Raise
    CannotStart if the server is not reached or not proven, RequestRefused if it refuses the token."""
    import httpx

    found = _found(options, _trust(options), without_editor=without_editor)
    reached = _reach(options, found)
    with httpx.Client(**reached) as client:
        if found.runner is not None:
            data = options.data.resolve()
            known = _runners_of(data, found, found.runner, without_editor=without_editor)
        else:
            known = _runner_urls(client, options, found, without_editor=without_editor)
        reached["auth"].named |= {each.url for each in known.sites if port_of(each) is None}
        yield Server(client, known.sites[0].url, found.no_editor, known)


def _runners_of(data: Path, found: _Found, runner: str, *, without_editor: bool) -> Known:
    """Return the runners of the server of a data folder, whose own is at the URL `runner`. Raise
    CannotStart if they cannot be read; `without_editor`: this one alone is asked then."""
    kept, unread = _kept(data)
    if unread and not without_editor:
        raise CannotStart(unread)
    first, *others = kept or (Site("", runner),)
    known = Known((Site(first.name, runner), *others))
    if unread:
        return _in_doubt(known.sites, unread)
    if found.no_editor and not others and not _is_of_an_editor(data):
        said = f"Only the runner of {data} was asked: an editor elsewhere may have further runners."
        return known._replace(further=said)
    return known


def _in_doubt(sites: tuple[Site, ...], why: str) -> Known:
    """Return runners of which nobody knows whether they are all. `why`: a sentence."""
    asked = " and ".join(f"{each.name} at {each.url}".removeprefix(" at ") for each in sites)
    return Known(
        sites,
        f"NOT KNOWN whether there are further runners: no Stop was sent except to {asked}. {why} Look "
        "at the robots; use their hardware stops.",
        is_in_doubt=True,
    )


def _runner_urls(
    client: "httpx.Client", options: argparse.Namespace, found: _Found, *, without_editor: bool
) -> Known:
    """Return the runners, as the editor says them. With a token that has expired it does not, and
    those known at the login count: such a token may still stop."""
    patience = {"timeout": _EDITOR_S} if without_editor else {}
    try:
        config = decoded(request(client, "GET", "/api/config", **patience), RunnerUrls)
    except (RequestRefused, CannotStart) as error:
        beside = None
        if without_editor:
            beside = _runners_beside(client.base_url, options, found)
        elif isinstance(error, RequestRefused) and error.status == 401:
            beside = _at_login(client.base_url)
        if beside is None:
            raise
        return beside
    return Known(config.runners or (Site("", config.runner_url),))


class RunnerUrls(msgspec.Struct, frozen=True):
    """The part of the editor's configuration that says where the runners are."""

    runner_url: str
    runners: tuple[Site, ...] = ()


def _runners_beside(
    editor: "httpx.URL", options: argparse.Namespace, found: _Found
) -> Known | None:
    """Return the runners beside an editor that does not say them: those that its data folder names,
    else those that were known at the login, else the one at the port after the editor's. Return None
    for an editor without a port in its URL, as behind a proxy, where nobody has signed in."""
    kept, is_all = _in_folder(str(editor), options.data.resolve())
    if kept:
        return Known(kept) if is_all else _in_doubt(kept, _EDITOR_SILENT)
    beside = _at_login(editor)
    if beside is None and editor.port is not None:
        url = editor.copy_with(port=editor.port + 1)
        if found.supposed:  # no editor was there to tell whether it speaks TLS
            url = url.copy_with(scheme=_scheme(editor.port + 1, _trust(options)))
        beside = _in_doubt((Site("", str(url).rstrip("/")),), _EDITOR_SILENT)
    return Known(beside.sites) if beside is not None and is_all else beside


def _at_login(editor: "httpx.URL") -> Known | None:
    """Return the runners that were known at the login; None where nobody has signed in."""
    stored = _stored(str(editor))
    if stored is None or not stored.runner_url:
        return None
    sites = stored.runners or (Site("", stored.runner_url),)
    return _in_doubt(sites, f"{_EDITOR_SILENT} These are the runners of the login.")


def _in_folder(editor: str, data: Path) -> tuple[tuple[Site, ...], bool]:
    """Return the sites that a data folder names, if it is that of an editor, and whether these are all
    runners: the editor of this folder lives at this URL, however long it has been silent."""
    try:
        sites, here, at = kept_sites(data), served_address(data, "editor"), server_key(editor)
        if here is not None and here.lives and here.is_here and server_key(here.url) == at:
            return sites, True
        port = urlsplit(at).port
        beside = {f"{at}/runner", f"http://127.0.0.1:{port + 1}" if port else ""}
        is_its_own = bool(sites) and server_key(sites[0].url) in beside
    except CannotStart as error:
        say(str(error), "warning")
        return (), False
    return (sites, False) if is_its_own else ((), False)


def reach(options: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of an httpx client that talks to the server which a command is meant
    for.

    The client sends a token only after the server has proven that it knows the token: that of the
    environment or of the data folder, else the one that `login` has stored for this server. Raise
    CannotStart if there is no token that can be read, or the server is not known.
    """
    found = _found(options, _trust(options))
    if found.no_editor:
        raise CannotStart(found.no_editor)
    return _reach(options, found)


def _reach(options: argparse.Namespace, found: _Found) -> dict[str, Any]:
    from action_assistant.commands.token_proof import AfterProof

    stored = _given(found.url)
    keys = _keys(options.data.resolve(), found.url, stored)
    return {
        "base_url": found.url,
        "auth": AfterProof(keys, stored, supposed=found.supposed),
        "timeout": 30,
        "trust_env": False,
        "verify": _trust(options),
    }


def _stored(url: str) -> StoredToken | None:
    """Return the token that `login` has stored for a server. A file that cannot be used is told, and
    stops no command that has another token."""
    try:
        return stored_token(url)
    except CannotStart as error:
        say(str(error), "warning")
        return None


def _given(url: str) -> StoredToken | None:
    """Return the program's token for a server: that of the environment, else what `login` stored
    there. None if the environment has the token of a server."""
    text = os.environ.get(_TOKEN, "")
    if not text:
        return _stored(url)
    return None if token_id(text) is None else StoredToken(url, text, f"of {_TOKEN}", (), 0.0)


def _keys(data: Path, url: str, stored: StoredToken | None) -> Keys | None:
    """Return the keys of a data folder, or None where it has none and `login` has stored a token.
    Raise CannotStart if there is neither."""
    if stored is not None and os.environ.get(_TOKEN):
        return None
    try:
        return Keys.known(data)
    except CannotStart as error:
        if stored is not None:
            return None
        raise CannotStart(f"{error} Or sign in: `action-assistant login {url}`.") from error


def _trust(options: argparse.Namespace) -> ssl.SSLContext:
    return Certificate(options.data.resolve()).trusting_too()


def _at_port(port: int, trust: ssl.SSLContext) -> str:
    """Return the URL of what listens at a port of this computer, http or https, which is tried.
    `trust`: the certificates to accept."""
    return f"{_scheme(port, trust)}://127.0.0.1:{port}"


def _scheme(port: int, trust: ssl.SSLContext) -> str:
    """Return "https" if TLS is spoken at a port of this computer with one of the certificates that
    `trust` accepts, else "http"."""
    with (
        contextlib.suppress(OSError),
        socket.create_connection(("127.0.0.1", port), 2) as plain,
        trust.wrap_socket(plain, server_hostname="127.0.0.1"),
    ):
        return "https"
    return "http"


def print_json(value: object) -> None:
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(value)).decode() + "\n")


def refused(why: str) -> int:
    """Print the reason `why` for which a part of a command was refused, and return the exit code of
    the command (1)."""
    print(f"action-assistant: {why}", file=sys.stderr)
    return 1
