"""A graph as it is sent in a body: a JSON object, or a string that holds the object's text.

JavaScript cannot put a JSON text into another one, and writes `5.0` as `5` when it has read it; as a
string the text goes through whole (docs/decisions/048-umrf-as-text.md).
"""

from typing import Annotated, Final, TypeAlias

import msgspec

from action_assistant.errors import BadInput, NotUmrf, TooLarge
from action_assistant.umrf.files import codec
from action_assistant.umrf.run_size import MOST_BYTES

#: Bytes of a body that carries graphs: what their texts may have, and room for all else that a start says.
MOST: Final = MOST_BYTES + 100_000

SentGraph: TypeAlias = Annotated[
    msgspec.Raw,
    msgspec.Meta(
        extra_json_schema={
            "description": "The UMRF graph itself, as approved, or a string that holds its JSON text",
            "anyOf": [{"type": "object", "additionalProperties": True}, {"type": "string"}],
        }
    ),
]


def counted(body: bytes) -> int:
    """The length that a body has at least without the escapes of a graph that is a string."""
    return len(body) - body.count(b"\\")


def read_sent(umrf: bytes) -> tuple[bytes, codec.Reading]:
    """The text of a graph, byte for byte as it was meant, and what it says. For workers.

    Raises BadInput, NotUmrf with the place, TooLarge.
    """
    text = _text_of(umrf)
    if len(text) > MOST_BYTES:
        raise TooLarge(
            f"A graph that is sent has at most {MOST_BYTES // 1_000_000} MB; this one has {len(text):,} bytes."
        )
    try:
        return text, codec.read(text)
    except codec.Unreadable as wrong:
        where: dict[str, object] = {"path": f"/umrf{wrong.path}"}
        if text is umrf:
            raise NotUmrf(wrong.message, where=where) from wrong
        kind = BadInput if wrong.code == "not-json" else NotUmrf
        where |= {"line": wrong.line, "column": wrong.column}
        raise kind(wrong.message, where=where) from wrong


def _text_of(umrf: bytes) -> bytes:
    if not umrf.startswith(b'"'):
        return umrf
    try:
        return msgspec.json.decode(umrf, type=str).encode()
    except msgspec.DecodeError as wrong:
        raise BadInput(f"The string is no text: {wrong}", where={"path": "/umrf"}) from wrong
