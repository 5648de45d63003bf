"""Tokens that `login` keeps: one private file for each server, in the user's configuration folder."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from urllib.parse import quote, urlsplit, urlunsplit

import msgspec

from action_assistant import paths
from action_assistant.errors import CannotStart
from action_assistant.private_files import DamagedFile, make_folder, read_json, replace_file
from action_assistant.settings import Site

_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO


class StoredToken(msgspec.Struct, frozen=True):
    """A token for one server. `url`: of the editor, as `server_key` writes it. `runner_url`: where
    the runner was at the login; "" if unknown. `runners`: all of them, if there were several. `name`: of the token. `expires`: seconds since
    1970.
    """

    url: str
    token: str
    name: str
    scopes: tuple[str, ...]
    expires: float
    runner_url: str = ""
    runners: tuple[Site, ...] = ()


def server_key(url: str) -> str:
    """Return the URL of a server in one form, so that spellings of one address are one server. Raise
    CannotStart if it is no URL of http or https."""
    try:
        parts = urlsplit(url.strip())
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port, parts = "", None, urlsplit("")
    if parts.scheme not in {"http", "https"} or not host or parts.username is not None:
        raise CannotStart(f"{url!r} is no URL of a server, such as https://lab.example:8000.")
    host = "127.0.0.1" if host == "localhost" else host
    host = f"[{host}]" if ":" in host else host
    where = host if port in {None, _PORTS[parts.scheme]} else f"{host}:{port}"
    return urlunsplit((parts.scheme, where, parts.path.rstrip("/"), "", ""))


_PORTS: Final = {"http": 80, "https": 443}


def file_of(url: str) -> Path:
    """Return the file in which the token for a server is kept."""
    return paths.config() / "tokens" / f"{quote(server_key(url), safe='')}.json"


def stored_token(url: str) -> StoredToken | None:
    """Return the token that is kept for a server; None if there is none. Raise CannotStart if the
    file cannot be read, or if others may read it."""
    path = file_of(url)
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise CannotStart(f"{path} cannot be read: {error.strerror}.") from error
    if hasattr(os, "geteuid") and mode & _OTHERS:
        raise CannotStart(f"Others may read {path}, which holds a token: chmod 600 it.")
    try:
        return msgspec.json.decode(content, type=StoredToken)
    except (ValueError, RecursionError) as error:
        raise CannotStart(f"{path} is no token that `login` stored ({error}).") from error


def every_stored_token() -> Iterator[StoredToken]:
    """Yield the stored tokens, sorted by server. Raise CannotStart if the file of a token cannot
    be read."""
    for path in sorted((paths.config() / "tokens").glob("*.json")):
        try:
            yield read_json(path, StoredToken)
        except (OSError, DamagedFile) as error:
            raise CannotStart(f"{path} cannot be read ({error}).") from error


def store(token: StoredToken) -> Path:
    """Keep a token in the place of an older one for the same server, and return its file. Raise
    CannotStart if the file cannot be written."""
    path = file_of(token.url)
    try:
        make_folder(path.parent)
        replace_file(path, msgspec.json.encode(token))
    except OSError as error:
        raise CannotStart(f"The token cannot be kept in {path}: {error.strerror}.") from error
    return path


def forget(url: str) -> None:
    """Delete the token that is kept for a server. Raise CannotStart if that fails."""
    path = file_of(url)
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise CannotStart(f"{path} cannot be deleted: {error.strerror}.") from error
