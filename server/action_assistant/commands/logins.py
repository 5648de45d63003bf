"""`login`, `logout` and `tokens`: tokens of programs, which a person confirms on the page."""

import argparse
import socket
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from action_assistant import paths
from action_assistant.commands.answers import decoded
from action_assistant.commands.client import (
    RunnerUrls,
    Server,
    command,
    print_json,
    request,
    running,
)
from action_assistant.commands.stored_tokens import (
    StoredToken,
    every_stored_token,
    forget,
    server_key,
    store,
    stored_token,
)
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.web.network.certificate import Certificate

if TYPE_CHECKING:  # slow to load, and most commands do not need them
    import httpx

    from action_assistant.web.auth.login_codes import Claimed, LoginBegun
    from action_assistant.web.auth.tokens import TokenRecord

_SCOPES: Final = ("read", "edit", "simulate", "operate", "scrape")
_DEFAULT: Final = ("read", "edit", "simulate")
_LONGEST_S: Final = 30.0  # between two questions while the server does not answer


def _add_login(login: argparse.ArgumentParser) -> None:
    login.epilog = f"example: {login.prog} https://lab.example:8000 --scope read --scope operate"
    login.add_argument("url", metavar="URL", help="of the editor, as in the browser")
    login.add_argument(
        "--name", default=f"CLI at {socket.gethostname()}"[:60], help="default: %(default)s"
    )
    _add_scopes(login)
    login.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="that holds tls/ca.pem"
    )
    login.set_defaults(handler=_login)


def _add_scopes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--scope",
        action="append",
        choices=_SCOPES,
        dest="scopes",
        help=f"may be given several times; default: {' '.join(_DEFAULT)}. `operate` starts real robots",
    )
    parser.add_argument("--days", type=float, help="until it expires; default: 90, or less there")


def _add_logout(logout: argparse.ArgumentParser) -> None:
    logout.epilog = f"example: {logout.prog} https://lab.example:8000"
    logout.add_argument("url", metavar="URL", help="as at the login")
    logout.add_argument(
        "--forget",
        action="store_true",
        help="delete the token here, also if the server does not answer; there it stays valid",
    )
    logout.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="that holds tls/ca.pem"
    )
    logout.set_defaults(handler=_logout)


def _add_tokens(tokens: argparse.ArgumentParser) -> None:
    tokens.description = "Tokens of programs: what a server knows, and what `login` stored here."
    tokens.epilog = "example: action-assistant tokens make nightly --scope read --days 30"
    words = tokens.add_subparsers(dest="word", required=True, metavar="WORD")

    stored = words.add_parser("stored", help="the tokens that `login` stored here, by server")
    stored.set_defaults(handler=_stored)

    listed = command(words, "list", "the tokens of a server, and their last use", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    make = command(words, "make", "make a token and print it, once", "nightly --scope read")
    make.add_argument("name", metavar="NAME", help="of the program")
    _add_scopes(make)
    make.set_defaults(handler=_make)

    revoke = command(words, "revoke", "end a token at once and for good", "trlQRDEFzMaX")
    revoke.add_argument("id", metavar="ID", help="as `tokens list` shows it")
    revoke.set_defaults(handler=_revoke)


COMMANDS: Final = {"login": _add_login, "logout": _add_logout, "tokens": _add_tokens}


def _login(options: argparse.Namespace) -> int:
    from action_assistant.web.auth.login_codes import LoginBegun

    url = server_key(options.url)
    wanted: dict[str, Any] = {"name": options.name, "scopes": options.scopes or _DEFAULT}
    if options.days is not None:
        wanted["days"] = options.days
    with _client(url, options) as client:
        begun = decoded(request(client, "POST", "/api/logins", json=wanted), LoginBegun)
        try:  # whoever has seen the code may press Ctrl-C
            print(f"Code: {begun.code}")
            print(f"Confirm it on the page: {url}/programs#code={begun.code}", flush=True)
            granted = _wait(client, begun)
        except KeyboardInterrupt:
            request(client, "POST", "/api/logins/cancel", json={"secret": begun.secret})
            raise
        _keep(client, url, granted)
    return 0


def _wait(client: "httpx.Client", begun: "LoginBegun") -> "Claimed":
    """Ask for the token until a person has confirmed the code. Raise RequestRefused if the person
    refuses it, or nobody confirms it in time."""
    from action_assistant.web.auth.login_codes import Claimed

    ends_at = time.monotonic() + begun.expires_in
    wait = silent = float(begun.interval)
    while time.monotonic() < ends_at:
        time.sleep(wait)
        try:
            answer = request(client, "POST", "/api/logins/claim", json={"secret": begun.secret})
        except (CannotStart, RequestRefused) as error:
            if isinstance(error, RequestRefused) and error.status not in {429, 502, 503, 504}:
                raise
            wait = silent = min(2 * silent, _LONGEST_S)
            continue
        said = decoded(answer, Claimed)
        wait = silent = float(said.interval)
        match said.state:
            case "granted":
                return said
            case "refused":
                raise RequestRefused("The login was refused on the page.")
            case "gone":
                break
    raise RequestRefused("The code is not valid any more: nobody confirmed it in time.")


def _keep(client: "httpx.Client", url: str, granted: "Claimed") -> None:
    """Store a new token, tell it to the runner, and revoke the one that it replaces."""
    if granted.made is None:
        raise CannotStart(f"{url} answers in another form than this version expects.")
    made, before = granted.made, _before(url)
    record, bearer = made.record, {"authorization": f"Bearer {made.token}"}
    kept = StoredToken(url, made.token, record.name, record.scopes, record.expires)
    try:
        path = store(kept)
    except CannotStart:
        _end_at(client, "", record.id, made.token)
        raise
    if "read" in record.scopes:
        urls = decoded(request(client, "GET", "/api/config", headers=bearer), RunnerUrls)
        kept = msgspec.structs.replace(kept, runner_url=urls.runner_url, runners=urls.runners)
        store(kept)
        for runner in _runners(kept):
            _tell_runner(client, runner, record)
    if before is not None:
        _end_before(client, before)
    print(
        one_line(
            f"Signed in as {record.person.name or 'a person without a name'}, by program "
            f"{record.name}: {' '.join(record.scopes)}, until {_day(record.expires)}."
        )
    )
    print(f"The token is kept in {path}.")


def _before(url: str) -> StoredToken | None:
    try:
        return stored_token(url)
    except CannotStart:  # the new one replaces what cannot be read
        return None


def _runners(token: StoredToken) -> list[str]:
    """Return the URLs of all runners at which a stored token may be known."""
    urls = (token.runner_url, *(each.url for each in token.runners))
    return [url for url in dict.fromkeys(urls) if url]


def _end_before(client: "httpx.Client", before: StoredToken) -> None:
    """Revoke the token of the login before, as far as the server still knows it."""
    from action_assistant.web.auth.token_text import token_id

    for where in ("", *_runners(before)):
        try:
            _end_at(client, where, token_id(before.token) or "none", before.token)
        except (RequestRefused, CannotStart) as error:
            print(
                one_line(f"The token of the login before is still valid: {error}"), file=sys.stderr
            )
            return


def _end_at(client: "httpx.Client", where: str, token: str, bearer: str) -> None:
    """Revoke a token at the editor (`where` is "") or at the runner with the URL `where`. `token`:
    its id; `bearer`: its text, which authorises the request. No error is raised if the token is not
    valid there."""
    try:
        request(
            client,
            "POST",
            f"{where}/api/tokens/{token}/revoke",
            headers={"authorization": f"Bearer {bearer}"},
        )
    except RequestRefused as error:
        if error.status not in {401, 404}:
            raise


def _tell_runner(client: "httpx.Client", runner: str, record: "TokenRecord") -> None:
    body = {"record": msgspec.to_builtins(record)}
    try:
        request(client, "POST", f"{runner}/api/tokens/records", json=body)
    except (RequestRefused, CannotStart) as error:
        print(one_line(f"The runner does not know the token yet: {error}"), file=sys.stderr)


def _logout(options: argparse.Namespace) -> int:
    from action_assistant.web.auth.token_text import token_id

    url = server_key(options.url)
    kept = stored_token(url)
    if kept is None:
        raise RequestRefused(f"No token is stored for {url}.")
    with _client(url, options) as client:
        try:
            for where in ("", *_runners(kept)):
                _end_at(client, where, token_id(kept.token) or "none", kept.token)
        except (RequestRefused, CannotStart) as error:
            if not options.forget:
                raise CannotStart(
                    f"{error} The token is still stored and valid. Try again, or delete it here with "
                    "--forget."
                ) from error
            print(one_line(f"The token stays valid on the server: {error}"), file=sys.stderr)
    forget(url)
    print(f"Signed out of {url}: the token {kept.name} is deleted here.")
    return 0


def _stored(_: argparse.Namespace) -> int:
    for each in every_stored_token():
        over = "expired" if each.expires <= time.time() else "until"
        print(
            one_line(
                f"{each.url}  {each.name}  {' '.join(each.scopes)}  {over} {_day(each.expires)}"
            )
        )
    return 0


def _list(options: argparse.Namespace) -> int:
    from action_assistant.web.auth.tokens import TokenList

    with running(options) as server:
        answer = server.editor("GET", "/api/tokens")
        if options.json:
            print_json(answer.json())
            return 0
        for line in _lines(decoded(answer, TokenList)):
            print(one_line(line))
    return 0


def _lines(found: Any) -> Iterator[str]:
    for each in found.tokens:
        record = each.record
        used = "never used" if each.used is None else f"used {_day(each.used.at)}"
        maker = record.person.name or "somebody without a name"
        yield (
            f"{record.id}  {record.name}  {' '.join(record.scopes)}  by {maker}  "
            f"until {_day(record.expires)}  {used}"
        )


def _make(options: argparse.Namespace) -> int:
    from action_assistant.web.auth.tokens import MadeToken

    wanted: dict[str, Any] = {"name": options.name, "scopes": options.scopes or _DEFAULT}
    if options.days is not None:
        wanted["days"] = options.days
    with running(options) as server:
        made = decoded(server.editor("POST", "/api/tokens", json=wanted), MadeToken)
        print(made.token)
        try:
            server.runners.tell(
                "POST", "/api/tokens/records", json={"record": msgspec.to_builtins(made.record)}
            )
        except (RequestRefused, CannotStart) as error:
            print(one_line(f"The runner does not know it yet: {error}"), file=sys.stderr)
    print(
        one_line(f"{made.record.id}  {made.record.name}, until {_day(made.record.expires)}"),
        file=sys.stderr,
    )
    return 0


def _revoke(options: argparse.Namespace) -> int:
    with running(options) as server:
        path = f"/api/tokens/{options.id}/revoke"
        server.editor("POST", path)
        _revoke_at_runner(server, path)
    print(f"{options.id} is revoked.")
    return 0


def _revoke_at_runner(server: Server, path: str) -> None:
    """Revoke a token in runners with a data folder of their own; elsewhere it is gone already."""
    try:
        server.runners.tell("POST", path, gone=frozenset({404}))
    except (RequestRefused, CannotStart) as error:
        raise RequestRefused(f"Revoked at the editor, but not at the runner: {error}") from error


def _client(url: str, options: argparse.Namespace) -> "httpx.Client":
    import httpx

    trust = Certificate(options.data.resolve()).trusting_too()
    return httpx.Client(base_url=url, timeout=30, trust_env=False, verify=trust)


def _day(at: float) -> str:
    return datetime.fromtimestamp(at, UTC).strftime("%Y-%m-%d")
