"""A client that names another history of a graph is sent away before anything of it is taken."""

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages
from editor.api.test_sockets import acks, closed, got
from editor.process import Editor


async def told(session: httpx_ws.AsyncWebSocketSession) -> str:
    """The name of the history, the first thing that a socket hears."""
    frame = await session.receive_bytes(timeout=5)
    assert frame[0] == messages.EPOCH
    return messages.ByteReader(frame[1:]).text().decode()


async def entered(editor: Editor, graph: str, query: str) -> tuple[str, int | None]:
    """Return the epoch that a socket is sent, and the code with which it is closed, if it is."""
    async with editor.socket(graph, f"?{query}") as session:
        epoch = await told(session) if "acks" in query else ""
        if "lives" in query:
            await session.send_bytes(messages.question(b"\0"))
            await acks(session, 0)
            return epoch, None
        return epoch, await closed(session)


async def test_a_client_that_knows_this_history_comes_in(editor: Editor, graph: str) -> None:
    epoch, _ = await entered(editor, graph, "acks=1&lives")
    assert epoch
    assert await entered(editor, graph, f"acks=1&lives&epoch={epoch}") == (epoch, None)
    assert await entered(editor, graph, f"acks=1&lives&epoch={epoch}&seq=1") == (epoch, None)


@pytest.mark.parametrize("query", ["epoch=other", "epoch=", "seq=99", "epoch=other&acks=1"])
async def test_a_client_that_knows_another_one_is_sent_away(
    editor: Editor, graph: str, query: str
) -> None:
    _, code = await entered(editor, graph, query)
    assert code == messages.OTHER_EPOCH


@pytest.mark.parametrize("query", ["seq=x", "seq=-1", "seq=" + "9" * 30, "seq=", "seq=٣"])
async def test_a_seq_that_is_no_number_is_ignored(editor: Editor, graph: str, query: str) -> None:
    _, code = await entered(editor, graph, f"acks=1&lives&{query}")
    assert code is None


async def test_edits_of_another_epoch_are_refused(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    before = (await got(http, f"/api/graphs/{graph}")).json()["seq"]
    doc: Doc[object] = Doc()
    doc.get("meta", type=Map)["name"] = "of another history"
    async with editor.socket(graph, "?epoch=x") as session:
        await session.send_bytes(messages.answer(doc.get_update()))
        assert await closed(session) == messages.OTHER_EPOCH
    assert (await got(http, f"/api/graphs/{graph}")).json()["seq"] == before
