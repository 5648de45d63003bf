"""OpenAPI descriptions of bodies that are read by hand: bytes that must stay as they were sent."""

from dataclasses import dataclass, field
from typing import Final

from litestar.openapi.spec import (
    OpenAPIMediaType,
    OpenAPIType,
    Operation,
    Reference,
    RequestBody,
    Schema,
)

_TEXT: Final = Schema(type=OpenAPIType.STRING)
_OF_GRAPH: Final = ("version", "digest", "umrf")
_ANY: Final = Schema(type=OpenAPIType.OBJECT)


def _body(schema: Schema, *, required: bool) -> RequestBody:
    return RequestBody(content={"application/json": OpenAPIMediaType(schema)}, required=required)


def _start() -> RequestBody:
    codes = Schema(type=OpenAPIType.ARRAY, items=_TEXT)
    override = Schema(
        type=OpenAPIType.OBJECT,
        properties={"codes": codes, "reason": _TEXT},
        required=["codes", "reason"],
    )
    fields: dict[str, Schema | Reference] = {
        "version": _TEXT,
        "digest": _TEXT,
        "umrf": Schema(type=OpenAPIType.OBJECT, description="The UMRF graph itself, as approved"),
        "engine": Schema(type=OpenAPIType.STRING, description="`simulator`, or a robot's name"),
        "request_id": Schema(type=OpenAPIType.STRING, description="Made once per intended start"),
        "graph": _TEXT,
        "script": _ANY,
        "override": override,
        "like": Schema(type=OpenAPIType.STRING, description="The robot that the simulator plays"),
    }
    needed = ["version", "digest", "umrf", "engine", "request_id"]
    whole = Schema(
        type=OpenAPIType.OBJECT,
        properties=fields,
        required=needed,
        additional_properties=False,
    )
    return _body(whole, required=True)


def _group(*, look: bool) -> RequestBody:
    one = _start().content["application/json"].schema
    assert isinstance(one, Schema)
    names = Schema(type=OpenAPIType.ARRAY, items=_TEXT, min_items=1, max_items=20)
    fields = {k: v for k, v in (one.properties or {}).items() if k not in {"engine", "script"}}
    needed = [each for each in one.required or () if each != "engine"]
    if look:
        needed = ["umrf"]
    whole = Schema(
        type=OpenAPIType.OBJECT,
        properties={**fields, "engines": names},
        required=[*needed, "engines"],
        additional_properties=False,
    )
    return _body(whole, required=True)


def _modify() -> RequestBody:
    one = _start().content["application/json"].schema
    assert isinstance(one, Schema)
    fields = {k: v for k, v in (one.properties or {}).items() if k in {*_OF_GRAPH, "override"}}
    whole = Schema(
        type=OpenAPIType.OBJECT,
        properties={**fields, "continue_from": _TEXT},
        required=list(_OF_GRAPH),
        additional_properties=False,
    )
    return _body(whole, required=True)


def _stop() -> RequestBody:
    press = Schema(type=OpenAPIType.OBJECT, properties={"stop_id": _TEXT})
    return _body(press, required=False)


def _rest() -> RequestBody:
    how = Schema(type=OpenAPIType.STRING, min_length=3, max_length=500)
    whole = Schema(
        type=OpenAPIType.OBJECT,
        properties={"how": how},
        required=["how"],
        additional_properties=False,
    )
    return _body(whole, required=True)


def _fit() -> RequestBody:
    one = _start().content["application/json"].schema
    assert isinstance(one, Schema)
    umrf = (one.properties or {})["umrf"]
    fault = Schema(type=OpenAPIType.STRING, enum=["error", "false", "hang", "init_error"])
    fields: dict[str, Schema | Reference] = {"umrf": umrf, "action": _TEXT, "fault": fault}
    whole = Schema(
        type=OpenAPIType.OBJECT, properties=fields, required=["umrf"], additional_properties=False
    )
    return _body(whole, required=True)


@dataclass
class StartOperation(Operation):
    """A start."""

    request_body: RequestBody | Reference | None = field(default_factory=_start)

    def __post_init__(self) -> None:
        self.request_body = _start()  # Litestar passes None for handlers that read by themselves


@dataclass
class StopOperation(Operation):
    """A stop."""

    request_body: RequestBody | Reference | None = field(default_factory=_stop)

    def __post_init__(self) -> None:
        self.request_body = _stop()


@dataclass
class RestOperation(Operation):
    """How it was seen that a robot is at rest."""

    request_body: RequestBody | Reference | None = field(default_factory=_rest)

    def __post_init__(self) -> None:
        self.request_body = _rest()


@dataclass
class GroupOperation(Operation):
    """A start on several robots."""

    request_body: RequestBody | Reference | None = field(default_factory=lambda: _group(look=False))

    def __post_init__(self) -> None:
        self.request_body = _group(look=False)


@dataclass
class LookOperation(Operation):
    """A look before a start."""

    request_body: RequestBody | Reference | None = field(default_factory=lambda: _group(look=True))

    def __post_init__(self) -> None:
        self.request_body = _group(look=True)


@dataclass
class ModifyOperation(Operation):
    """Another version for a run."""

    request_body: RequestBody | Reference | None = field(default_factory=_modify)

    def __post_init__(self) -> None:
        self.request_body = _modify()


@dataclass
class FitOperation(Operation):
    """A recorded run for another version of its graph."""

    request_body: RequestBody | Reference | None = field(default_factory=_fit)

    def __post_init__(self) -> None:
        self.request_body = _fit()
