"""Routes that help to draw and keep nothing: UMRF text as pieces to paste, and rehearsals."""

import asyncio
from typing import Any

import msgspec
from litestar import Request, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor import catalogue, document
from action_assistant.editor.house import Door
from action_assistant.editor.rehearsal import Rehearsal, Rehearsing, Stage
from action_assistant.umrf.model import Note
from action_assistant.web.access import Needs


class Pieces(msgspec.Struct, frozen=True):
    """A UMRF text as the keys that a document would hold. `notes`: what was translated; `remarks`
    are the same with their places in the text."""

    dialect: str
    notes: tuple[str, ...]
    name: str
    actions: dict[str, Any]
    relations: dict[str, Any]
    positions: dict[str, Any]
    remarks: tuple[Note, ...] = ()


def routes(door: Door) -> list[ControllerRouterHandler]:
    """Everything that only helps to draw."""
    stage = Stage()

    @post(
        "/api/pieces",
        status_code=200,
        summary="Read UMRF text of any dialect, a graph or one action, as pieces of a document; "
        "nothing is stored",
        operation_id="readPieces",
        guards=[Needs("see")],
    )
    async def read_pieces(request: Request[Any, Any, Any]) -> Pieces:
        return await asyncio.to_thread(_pieces, await request.body())

    @post(
        "/api/graphs/{graph_id:str}/rehearsal",
        status_code=200,
        summary="What a graph would do by the engine's rules: its trace; nothing is recorded",
        operation_id="rehearse",
        guards=[Needs("see")],
    )
    async def rehearse(graph_id: str, data: Rehearsing) -> Rehearsal:
        house = door.house
        await house.catalogue.require(graph_id)
        moment = await house.sights.moment(graph_id, data.seq)
        return await stage.play(moment.seq, moment.graph, data)

    return [read_pieces, rehearse]


def _pieces(body: bytes) -> Pieces:
    reading = catalogue.read(body)
    maps = document.flatten(document.with_aids(reading.graph))
    return Pieces(
        reading.dialect,
        reading.notes,
        reading.graph.name,
        dict(maps["actions"]),
        dict(maps["relations"]),
        dict(maps["positions"]),
        reading.remarks,
    )
