"""The OpenAPI document of a process: its routes, and the types of what they take and answer.

Litestar describes routes and parameters. Bodies and answers are described by msgspec, which reads and
writes them. A route that reads its body by itself names the type in `opt=reads(Type)`; one whose
annotation does not say what it answers names it in Litestar's own `responses=`.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from inspect import cleandoc
from types import NoneType
from typing import Annotated, Any, Final, TypeAlias, get_args

import anyio
import msgspec
from anyio import to_thread
from litestar import Litestar, Request, Response, Router
from litestar.handlers import HTTPRouteHandler
from litestar.openapi import OpenAPIConfig, ResponseSpec
from litestar.openapi.plugins import JsonRenderPlugin
from litestar.openapi.spec import Components, SecurityScheme
from litestar.routes import HTTPRoute, WebSocketRoute
from msgspec import inspect as kinds

from action_assistant.version import VERSION
from action_assistant.web.auth.access import SignedIn
from action_assistant.web.auth.roles import Permission
from action_assistant.web.http.problems import PROBLEM_JSON, ProblemDetails

#: The bytes of a file, as they are.
FileBytes: TypeAlias = Annotated[str, msgspec.Meta(extra_json_schema={"format": "binary"})]

#: The largest number in an address: no JSON of a page has a larger whole one, nor a database many more.
#: Litestar checks the bounds of `Annotated[int | None, …]`, and not those of `Annotated[int, …] | None`.
MOST_NUMBER: Final = 1 << 53

_BODY: Final = "body_type"
_PARTS: Final = "part_types"
_MESSAGES: Final = "message_types"
_REF: Final = "#/components/schemas/{name}"


def reads(body: object, **parts: object) -> dict[str, object]:
    """Return the value for `opt=` of a route that decodes its body (or `parts` of it) by itself:
    the type of the body, `Type | None` if it may be missing, and named types to which it refers."""
    return {_BODY: body, _PARTS: parts}


def exchanges(**messages: object) -> dict[str, object]:
    """Return the value for `opt=` of a WebSocket route: the types of its messages, by their names
    in the document."""
    return {_MESSAGES: messages}


def answer(
    kind: object,
    *,
    media: str = "application/json",
    text: str = "Request fulfilled, document follows",
) -> ResponseSpec:
    """Return the value for `responses=` of a route whose annotation does not give the type of its
    answer. `kind`: that type; `media`: its media type; `text`: its description."""
    return ResponseSpec(
        data_container=kind,
        generate_examples=False,
        description=text,
        media_type=media,
    )


class OpenApiText(JsonRenderPlugin):
    """The OpenAPI document as JSON, made at the first request on a thread, since it takes a fifth
    of a second. `make` returns the document."""

    def __init__(self) -> None:
        super().__init__(path="/openapi.json")
        self.make: Callable[[], dict[str, Any]] = dict
        self._text = b""
        self._turn = anyio.Lock()

    def made(self) -> bytes:
        """Return the document, rendered anew, as JSON."""
        return msgspec.json.encode(self.make())

    def router(self) -> Router:
        """Return the route of the document, which replaces Litestar's own: that one would block the
        event loop."""

        # Litestar copies what it is given, but no functions.
        async def answer(request: Request[Any, Any, Any]) -> Response[bytes] | None:
            if request.route_handler.media_type != self.media_type:
                return None  # there is no such page
            return Response(await self._known(), media_type=self.media_type)

        return Router(
            "/schema",
            route_handlers=[],
            guards=[SignedIn()],
            before_request=answer,
            include_in_schema=False,
            dto=None,
            return_dto=None,
        )

    async def _known(self) -> bytes:
        async with self._turn:
            if not self._text:
                self._text = await to_thread.run_sync(self.made)
        return self._text


def openapi_config(title: str, text: OpenApiText) -> OpenAPIConfig:
    """Return the OpenAPI configuration for Litestar, with the route that `text` gives."""
    schemes: dict[str, Any] = {"token": SecurityScheme(type="http", scheme="bearer")}
    return OpenAPIConfig(
        title=title,
        version=VERSION,
        openapi_router=text.router(),
        render_plugins=[text],
        components=Components(security_schemes=schemes),
        security=[{"token": []}],
    )


def document(
    app: Litestar, needs: Mapping[tuple[str, str], Permission], is_open: Callable[[str], bool]
) -> dict[str, Any]:
    """Return the OpenAPI document of the application `app`. `needs`: the permission by path and
    method, which becomes `x-needs`; `is_open`: returns True for a path without authentication,
    which gets an empty `security` (Litestar omits that)."""
    found = app.openapi_schema.to_schema()
    types = _Types()
    for path, method, handler in _handlers(app):
        operation = found["paths"][path][method]
        if is_open(path):
            operation["security"] = []
        elif (path, method) in needs:
            operation["x-needs"] = needs[path, method]
        _describe(operation, handler, types)
    for route in app.routes:
        if isinstance(route, WebSocketRoute):
            types.messages |= route.route_handler.opt.get(_MESSAGES, {})
    found["components"]["schemas"] = types.written()
    return found


def _handlers(app: Litestar) -> Iterator[tuple[str, str, HTTPRouteHandler]]:
    for route in app.routes:
        for handler in route.route_handlers if isinstance(route, HTTPRoute) else ():
            for method in handler.http_methods:
                if handler.resolve_include_in_schema() and method != "OPTIONS":
                    yield route.path_format, method.lower(), handler


def _describe(operation: dict[str, Any], handler: HTTPRouteHandler, types: "_Types") -> None:
    """Add the types of the body and answers of a route (`handler`) to its operation in the
    document, and collect them in `types`."""
    signature = handler.parsed_fn_signature
    data = signature.parameters.get("data")
    body = handler.opt.get(_BODY, None if data is None else data.annotation)
    types.parts |= handler.opt.get(_PARTS, {})
    if body is not None:
        parts = get_args(body)
        kind = next(each for each in parts if each is not NoneType) if NoneType in parts else body
        content = {"application/json": types.asked(kind)}
        operation["requestBody"] = {"content": content, "required": kind is body}
    answers = operation["responses"]
    answers.pop("400", None)  # Litestar's own form of it, which is never sent
    answers["default"] = {
        "description": "Refused",
        "content": {PROBLEM_JSON: types.answered(ProblemDetails)},
    }
    told = {code: spec.data_container for code, spec in (handler.responses or {}).items()}
    if handler.status_code not in told:
        returned = signature.return_type
        plain = returned.inner_types[0] if returned.is_subclass_of(Response) else returned
        told[handler.status_code] = plain.annotation
    for code, kind in told.items():
        described = answers[str(code)]
        if kind in {None, NoneType}:
            described.pop("content", None)
        for media in described.get("content", {}):
            described["content"][media] = types.answered(kind)


class _Types:
    """The types that routes name, and where their schemas belong."""

    def __init__(self) -> None:
        self.parts: dict[str, object] = {}
        self.messages: dict[str, object] = {}
        self._asked: list[tuple[object, dict[str, Any]]] = []
        self._answered: list[tuple[object, dict[str, Any]]] = []

    def asked(self, kind: object) -> dict[str, Any]:
        """Return the schema of a request body of the type `kind`: an empty object, which `written`
        fills in later."""
        self._asked.append((kind, {}))
        return self._asked[-1][1]

    def answered(self, kind: object) -> dict[str, Any]:
        """Return the schema of an answer of the type `kind`: an empty object, which `written` fills
        in later."""
        self._answered.append((kind, {}))
        return self._answered[-1][1]

    def written(self) -> dict[str, Any]:
        """Fill in all schemas; return the named ones for `components`."""
        places = [*self._asked, *self._answered]
        named = self.parts | self.messages
        kinds_of = [*(kind for kind, _ in places), *named.values()]
        shapes, components = msgspec.json.schema_components(
            kinds_of, schema_hook=_anything, ref_template=_REF
        )
        for (_, place), shape in zip(places, shapes, strict=False):
            place["schema"] = shape
        asked = _structs([*(kind for kind, _ in self._asked), *self.parts.values()])
        answered = _structs([*(kind for kind, _ in self._answered), *self.messages.values()])
        for cls, struct in (asked | answered).items():
            _complete(components[cls.__name__], struct, only_answered=cls not in asked)
        both = [cls for cls, struct in asked.items() if cls in answered and _may_lack(struct)]
        assert not both, f"of one shape in bodies, of another in answers: {both}"
        aliases = zip(named, shapes[len(places) :], strict=True)
        components |= {name: shape for name, shape in aliases if name not in components}
        return dict(sorted(components.items()))


def _anything(kind: type) -> dict[str, Any]:
    """Return the schema of the type `object`, for which msgspec has none. Raise NotImplementedError
    for another type."""
    if kind is not object:
        raise NotImplementedError
    return {"description": "Any JSON value"}


def _structs(types: Iterable[object]) -> dict[type, kinds.StructType]:
    """Return every struct that values of the given types may hold, at any depth."""
    found: dict[type, kinds.StructType] = {}
    left: list[object] = list(kinds.multi_type_info(types))
    while left:
        node = left.pop()
        if isinstance(node, kinds.StructType):
            if node.cls in found:
                continue
            found[node.cls] = node
        if isinstance(node, kinds.Type | kinds.Field):
            values = [getattr(node, name) for name in node.__struct_fields__]
            left += [
                each
                for value in values
                for each in (value if isinstance(value, tuple) else [value])
            ]
    return found


def _may_lack(struct: kinds.StructType) -> bool:
    """Return whether a request body may lack fields of a struct that answers always have."""
    defaults = any(not field.required for field in struct.fields)
    return defaults and not struct.cls.__struct_config__.omit_defaults


def _complete(shape: dict[str, Any], struct: kinds.StructType, *, only_answered: bool) -> None:
    """Add to the schema `shape` of a struct facts that msgspec omits. Answers always have the
    fields with a default, or never have them as null. Times have the format `date-time`."""
    omits = struct.cls.__struct_config__.omit_defaults
    shape["description"] = re.sub(r"\bNone\b", "null", cleandoc(struct.cls.__doc__ or ""))
    for field in struct.fields:
        described = shape["properties"][field.encode_name]
        if only_answered and omits and field.default is None and "anyOf" in described:
            described.pop("default")
            described["anyOf"].remove({"type": "null"})
        elif only_answered and not omits and _has_default(field):
            described.pop("default", None)
            shape["required"].append(field.encode_name)
        inner = field.type.types if isinstance(field.type, kinds.UnionType) else (field.type,)
        if any(isinstance(each, kinds.DateTimeType) for each in inner):
            for each in described.get("anyOf", [described]):
                each |= {"format": "date-time"} if each["type"] == "string" else {}
    _type_enums(shape)


def _has_default(field: kinds.Field) -> bool:
    """Return whether a missing field gets a value. `UNSET` is no value and never sent."""
    return field.default is not msgspec.NODEFAULT or field.default_factory is not msgspec.NODEFAULT


def _type_enums(shape: dict[str, Any]) -> None:
    """Add the type `string` to every enumeration of strings in a schema, at any depth."""
    if all(isinstance(each, str) for each in shape.get("enum", [None])):
        shape["type"] = "string"
    for value in shape.values():
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, dict):
                _type_enums(each)
