"""Starts that are kept as they were sent, and carried out later. Pure."""

from typing import Any

import msgspec

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.runs.sent_graphs import read_sent
from action_assistant.runner.start.admission import GroupRequest, StartRequest, script_of
from action_assistant.runner.start.casting import require_not_led
from action_assistant.runner.start.orders import require_plain
from action_assistant.umrf.digest import digest
from action_assistant.umrf.model import Graph


def text_of(start: StartRequest) -> msgspec.Raw:
    """Return a start as JSON, with its graph word for word."""
    fields: dict[str, Any] = {
        each.encode_name: getattr(start, each.name) for each in msgspec.structs.fields(start)
    }
    lacking = [
        name
        for name, value in fields.items()
        if isinstance(value, msgspec.Raw) and not bytes(value)
    ]
    for name in lacking:
        del fields[name]
    return msgspec.Raw(msgspec.json.encode(fields))


def ordered_in(start: StartRequest) -> bytes:
    """Return as JSON what a person orders by a start. The editor seals the rules of a version anew for
    each request, so they are no part of it."""
    return bytes(text_of(msgspec.structs.replace(start, sight=None)))


def start_of(text: msgspec.Raw) -> StartRequest:
    """Return the start in a text of `text_of`. Raise msgspec.DecodeError for a damaged one."""
    return msgspec.json.decode(bytes(text), type=StartRequest)


def graph_of(start: StartRequest) -> Graph:
    """Return the graph of a start. For workers. Raise Conflict for another digest, NotUmrf or TooLarge
    for a graph that cannot be read."""
    _, reading = read_sent(bytes(start.umrf))
    found = digest(reading.graph)
    if found != start.digest:
        raise Conflict(
            "The graph that was sent is not the one that was approved: its digest is "
            f"{found[:12]}…, not {start.digest[:12]}…. Nothing was opened.",
            where={"path": "/start/digest"},
        )
    return reading.graph


def require_form(start: StartRequest) -> None:
    """Raise BadInput, as a start at once does, for fields that mean nothing on the engine of a start."""
    try:
        if start.engine != CONDUCTED:
            require_not_led(start.robots, start.people)
        if start.engine != SIMULATOR:
            require_plain(start)
        script_of(start)
    except BadInput as why:
        where = why.where or {}
        raise BadInput(
            why.detail, where=where | {"path": f"/start{where.get('path', '')}"}
        ) from why


def group_of(start: StartRequest, engines: tuple[str, ...] = ()) -> GroupRequest:
    """Return the request of a pre-flight of a start, or of one on several robots. `engines`: these, in
    place of the one that it names."""
    names = {each.name for each in msgspec.structs.fields(GroupRequest)}
    fields = {
        each.name: getattr(start, each.name)
        for each in msgspec.structs.fields(start)
        if each.name in names
    }
    return GroupRequest(engines=engines or (start.engine,), **fields)
