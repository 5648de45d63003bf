"""Who asks the runner for something, and from where, as runs record it."""

import ipaddress
from typing import Any

from litestar.connection import ASGIConnection

from action_assistant.runner.events import Author
from action_assistant.web.access import person_of, session_of


def author_of(connection: ASGIConnection[Any, Any, Any, Any]) -> Author:
    """The person behind a request or a socket. Programs send the token, browsers have a session."""
    person = person_of(connection)
    return Author(
        person.id,
        person.name,
        by="program" if session_of(connection) is None else "browser",
        address=_address(connection.client.host if connection.client else ""),
    )


def _address(host: str) -> str:
    """An address on the network; "" for this computer itself, and for what is no address."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return ""
    return "" if address.is_loopback else str(address)
