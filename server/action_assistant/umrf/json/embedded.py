"""Types for UMRF graphs inside other JSON, with their schema."""

from typing import Annotated, Any, Final, TypeAlias

import msgspec

_OBJECT: Final[dict[str, Any]] = {"type": "object", "additionalProperties": True}

#: Any JSON object.
JsonObject: TypeAlias = Annotated[msgspec.Raw, msgspec.Meta(extra_json_schema=_OBJECT)]
#: A graph in an answer, with its numbers spelled as they were given.
UmrfGraph: TypeAlias = Annotated[
    msgspec.Raw, msgspec.Meta(extra_json_schema={**_OBJECT, "description": "A UMRF graph."})
]
