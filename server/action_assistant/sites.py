"""Several runners for one page: a name and a URL for each, as the settings of the editor give them."""

import unicodedata
from collections.abc import Iterable
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.private_files import read_json, replace_file
from action_assistant.public_url import PublicUrl
from action_assistant.settings import LOOPBACK, Site

_LONGEST_NAME: Final = 40
_FILE: Final = "runners.json"


def sites(
    given: Iterable[str],
    *,
    page_port: int,
    runner_port: int,
    public: PublicUrl | None = None,
    tls: bool = False,
) -> tuple[Site, ...]:
    """Parse texts NAME=URL, of which the first is the runner beside the editor at `runner_port`, and
    return the sites; empty without any, since one runner needs no name. `page_port`: of the editor.

    A browser shows a session only to the host of the page. So each runner is at a port of this
    computer, or below the public address. Raise CannotStart, with the text, if one cannot be used.
    """
    found: list[Site] = []
    for text in filter(str.strip, given):
        name, _, url = (part.strip() for part in text.partition("="))
        site = Site(unicodedata.normalize("NFC", name), url.rstrip("/"))
        if not (name and url) or len(name) > _LONGEST_NAME or not name.isprintable() or ";" in text:
            raise CannotStart(
                f"A runner is written NAME=URL, with a name of at most {_LONGEST_NAME} letters, not "
                f"{text.strip()!r}."
            )
        _check(site, public)
        if port_of(site) == page_port:
            raise CannotStart(
                f"The runner {name!r} is at {site.url}, the port of the editor itself: a runner has a port "
                "of its own."
            )
        for other in found:
            if other.name.casefold() == site.name.casefold():
                raise CannotStart(f"Two runners are called {name!r}.")
            if _place(other) == _place(site):
                raise CannotStart(
                    f"The runners {other.name!r} and {name!r} have one URL, {site.url}."
                )
        found.append(site)
    if not found:
        return ()
    if len(found) == 1:
        raise CannotStart(
            f"{found[0].name!r} is the only runner that is named. Name all, first the one beside the "
            "editor, or leave it out: one runner needs no name."
        )
    if tls:
        raise CannotStart(
            "Several runners cannot be served with --tls, since each would have a certificate of its "
            "own: put a proxy before them, and name its address with --public-url."
        )
    beside = f"http://127.0.0.1:{runner_port}" if public is None else public.runner
    is_beside = port_of(found[0]) == runner_port if public is None else found[0].url == beside
    if not is_beside:
        raise CannotStart(
            f"The first --runner is the one beside the editor, at {beside}, not {found[0].url}."
        )
    return tuple(found)


def port_of(site: Site) -> int | None:
    """Return the port of this computer that a URL means; None for a URL of another host."""
    parts = urlsplit(site.url)
    return parts.port or 80 if (parts.hostname or "") in LOOPBACK else None


def _place(site: Site) -> object:
    """Return what is the same for two URLs of one runner."""
    return port_of(site) or site.url


def _check(site: Site, public: PublicUrl | None) -> None:
    try:
        parts = urlsplit(site.url)
        port = parts.port
    except ValueError as error:
        raise CannotStart(
            f"The URL of the runner {site.name!r} cannot be read: {error}."
        ) from error
    if (
        parts.scheme not in {"http", "https"}
        or not parts.hostname
        or not site.url.isascii()
        or any(each.isspace() for each in site.url)
        or parts.username is not None
        or parts.query
        or parts.fragment
    ):
        raise CannotStart(
            f"The URL of the runner {site.name!r} is none: {site.url!r}. It has http:// or https://, a "
            "host, and a port or path."
        )
    if public is not None:
        if not site.url.startswith(f"{public.page}/"):
            raise CannotStart(
                f"The runner {site.name!r} is at {site.url}, outside of the public address "
                f"{public.page}/: browsers show a session of the page only to what is below it."
            )
    elif parts.scheme != "http" or parts.hostname not in LOOPBACK or port is None or parts.path:
        raise CannotStart(
            f"The runner {site.name!r} is at {site.url}: without --public-url it has to be at a port of "
            "this computer, such as http://127.0.0.1:8011, since browsers show a session of the page "
            "only to its own host. For runners elsewhere put a proxy before all, and name its address "
            "with --public-url."
        )


def keep_sites(data: Path, found: tuple[Site, ...]) -> None:
    """Keep the sites in the data folder, where commands find them without the editor. Raise OSError
    if that fails."""
    if found:
        replace_file(data / _FILE, msgspec.json.encode(found))
    else:
        (data / _FILE).unlink(missing_ok=True)


def kept_sites(data: Path) -> tuple[Site, ...]:
    """Return the sites of a data folder; empty with one runner. Raise CannotStart if they cannot be
    read."""
    path = data / _FILE
    try:
        found = read_json(path, tuple[Site, ...])
        for each in found:
            port_of(each)  # of a damaged URL there is none
    except (FileNotFoundError, NotADirectoryError):
        return ()
    except (OSError, ValueError) as error:
        raise CannotStart(f"The runners in {path} cannot be read ({error}).") from error
    return found
