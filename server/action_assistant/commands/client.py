"""How commands talk to a running server: with the token, over HTTP or TLS."""

import argparse
import contextlib
import os
import re
import socket
import ssl
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import msgspec

from action_assistant import paths, settings
from action_assistant.commands.stored_tokens import StoredToken, stored_token
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.logs import say
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.token_text import token_id
from action_assistant.web.network.certificate import Certificate

if TYPE_CHECKING:  # slow to load, and most commands do not need it
    import httpx


T = TypeVar("T")

_TOKEN: Final = "ACTION_ASSISTANT_TOKEN"
_EDITOR_S: Final = 3.0  # for which a Stop waits for the editor, which only says where the runner is
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
    parser.add_argument(
        "--url",
        "--server",
        metavar="URL",
        help="of the editor, or the public address of a server (default: the editor's port here)",
    )
    parser.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="that holds the token"
    )


class Server:
    """A client of a running editor and its runner."""

    def __init__(self, editor: "httpx.Client", runner_url: str) -> None:
        self._client = editor
        self._runner_url = runner_url

    @property
    def url(self) -> str:
        """Return the URL of the editor without a final slash."""
        return str(self._client.base_url).rstrip("/")

    def editor(self, method: str, path: str, **body: Any) -> "httpx.Response":
        """Send a request to the editor, wait for the answer and return it. `body`: further
        arguments of httpx. Raise RequestRefused, with one sentence, if it is refused."""
        return request(self._client, method, path, **body)

    def runner(self, method: str, path: str, **body: Any) -> "httpx.Response":
        """Send a request to the runner, wait for the answer and return it. `body`: further
        arguments of httpx. Raise RequestRefused, with one sentence, if it is refused."""
        return request(self._client, method, self._runner_url + path, **body)

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
        raise RequestRefused(sentence(answer), answer.status_code)
    return answer


def sentence(answer: "httpx.Response") -> str:
    """Return title and detail of a refusal in one line, with the place in the request if it names
    one. If the body is no refusal of this program, return the URL and the status code."""
    try:
        problem = answer.json()
        place = (problem.get("where") or {}).get("path", "")
        return f"{problem['title']}: {problem['detail']}" + (f" (at {place})" if place else "")
    except (ValueError, KeyError, AttributeError):
        return f"{answer.request.url} answered {answer.status_code}."


@contextmanager
def running(options: argparse.Namespace, *, without_editor: bool = False) -> Iterator[Server]:
    """Yield a client, with the token, of the server that the options name. `without_editor`: where
    the editor does not answer within 3 s, the runner is looked for at the port after it. Raise
    CannotStart if the server is not reached or not proven, RequestRefused if it refuses the token."""
    import httpx

    with httpx.Client(**reach(options)) as client:
        yield Server(client, _runner_url(client, options, without_editor=without_editor))


def _runner_url(
    client: "httpx.Client", options: argparse.Namespace, *, without_editor: bool = False
) -> str:
    """Return the URL of the runner. With a token that has expired the editor does not say it, and the
    one that was known at the login counts: such a token may still stop."""
    patience = {"timeout": _EDITOR_S} if without_editor else {}
    try:
        url: str = request(client, "GET", "/api/config", **patience).json()["runner_url"]
    except RequestRefused as refusal:
        stored = _stored(str(client.base_url))
        if refusal.status != 401 or stored is None or not stored.runner_url:
            raise
        return stored.runner_url
    except CannotStart:
        beside = _runner_beside(client.base_url, options) if without_editor else None
        if beside is None:
            raise
        return beside
    return url


def _runner_beside(editor: "httpx.URL", options: argparse.Namespace) -> str | None:
    """Return the URL of the runner beside an editor that does not answer: the one that was known at
    the login, else the port after the editor's. Return None for an editor without a port in its
    URL, as behind a proxy, where nobody has signed in."""
    stored = _stored(str(editor))
    if stored is not None and stored.runner_url:
        return stored.runner_url
    if editor.port is None:
        return None
    url = editor.copy_with(port=editor.port + 1)
    if not _named(options):  # no editor was there to tell whether it speaks TLS
        url = url.copy_with(scheme=_scheme(editor.port + 1, _trust(options)))
    return str(url).rstrip("/")


def reach(options: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of an httpx client that talks to the server which a command is meant
    for.

    The client sends a token only after the server has proven that it knows the token: that of the
    environment or of the data folder, else the one that `login` has stored for this server. Raise
    CannotStart if there is no token that can be read.
    """
    from action_assistant.commands.token_proof import AfterProof

    data = options.data.resolve()
    named, trust = _named(options), _trust(options)
    url = named or _here(trust)
    stored = _given(url)
    keys = _keys(data, url, stored)
    return {
        "base_url": url,
        "auth": AfterProof(keys, stored, supposed=not named),
        "timeout": 30,
        "trust_env": False,
        "verify": trust,
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


def _named(options: argparse.Namespace) -> str | None:
    return options.url or os.environ.get("ACTION_ASSISTANT_URL")


def _trust(options: argparse.Namespace) -> ssl.SSLContext:
    return Certificate(options.data.resolve()).trusting_too()


def _here(trust: ssl.SSLContext) -> str:
    """Return the URL of the server on this computer, http or https, which is tried. `trust`: the
    certificates to accept."""
    port = settings.port()
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


def decoded(answer: "httpx.Response", kind: type[T]) -> T:
    """Decode the JSON body of an answer as this type. Raise CannotStart for a server whose answers
    have another form."""
    try:
        return msgspec.json.decode(answer.content, type=kind)
    except msgspec.DecodeError as error:
        raise CannotStart(
            f"{answer.request.url} answers in another form than this version expects ({error})."
        ) from error


def print_json(value: object) -> None:
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(value)).decode() + "\n")


def refused(why: str) -> int:
    """Print the reason `why` for which a part of a command was refused, and return the exit code of
    the command (1)."""
    print(f"action-assistant: {why}", file=sys.stderr)
    return 1
