"""Scripts: how actions behave in a simulation (docs/contracts.md 5.2)."""

from collections.abc import Iterable
from typing import Annotated, Any, Final

import msgspec

from action_assistant.umrf.model import OUTCOMES

_OUTCOME: Final = msgspec.Meta(extra_json_schema={"enum": list(OUTCOMES)})
#: The schema of a field that `script_from` reads; the route names `Script` beside its body.
SCRIPT: Final = msgspec.Meta(extra_json_schema={"$ref": "#/components/schemas/Script"})


class Behaviour(msgspec.Struct, frozen=True, kw_only=True):
    """The behaviour of one call of an action. Times are seconds.

    `after_s`: how long it runs. `result`: how it ends. `stop_s`: how long a stop takes. `never`: it
    does not end by itself. `ignores_stop`: it continues until its own end; 5 s after a stop the engine
    calls it ERROR. `stop_error`: it throws in onStop; the engine shows ERROR at once, whatever its code
    does. `pauses`: it has an onPause. `load_s`: how long it loads (library and `onInit`) when it is
    triggered for the first time, which the engine does not count as running. `init_error`: it throws
    when it is loaded. `no_library`: it is indexed and its library is missing, so that no graph with it
    can be built (read from its first call). `outputs`: values by flat name; others get the value of the
    file, else their first allowed value, else the neutral one of their type. `message`: a line of its
    log.
    """

    after_s: float = 1.0
    result: Annotated[str, _OUTCOME] = "on_true"
    stop_s: float = 0.05
    load_s: float = 0.0
    pauses: bool = True
    never: bool = False
    ignores_stop: bool = False
    stop_error: bool = False
    init_error: bool = False
    no_library: bool = False
    outputs: dict[str, Any] | None = None
    message: str | None = None


DEFAULT: Final = Behaviour()


class Script(msgspec.Struct, frozen=True):
    """Behaviours of actions by key. A key has one behaviour for each call of the action; the last
    one repeats."""

    behaviours: dict[str, tuple[Behaviour, ...]] = {}

    def calls_of(self, running: str, own: str, full_name: str, name: str) -> tuple[Behaviour, ...]:
        """Return the behaviours of an action in the graph that runs as `running` and calls itself
        `own`.

        The most specific key wins: `running/full_name`, `own/full_name`, the full name, the name,
        `*`.
        """
        keys = (f"{running}/{full_name}", f"{own}/{full_name}", full_name, name, "*")
        for key in keys:
            if found := self.behaviours.get(key):
                return found
        return (DEFAULT,)


def script_json(script: Script) -> dict[str, Any]:
    """Return a script as JSON values that `script_from` reads, without members that have their
    default."""
    usual = msgspec.to_builtins(DEFAULT)
    return {
        "behaviours": {
            key: [
                {
                    name: value
                    for name, value in msgspec.to_builtins(call).items()
                    if value != usual[name]
                }
                for call in calls
            ]
            for key, calls in script.behaviours.items()
        }
    }


def script_from(value: object) -> Script:
    """Read a script from parsed JSON. Raises `ValueError`, with the place in its message, if the
    value is no script."""
    if not isinstance(value, dict) or not isinstance(value.get("behaviours", {}), dict):
        raise ValueError("A script is an object with “behaviours”, an object.")
    unknown = sorted(map(str, value.keys() - {"behaviours"}))
    if unknown:
        raise ValueError(f"A script has no {', '.join(unknown)}; it has “behaviours”.")
    found: dict[str, tuple[Behaviour, ...]] = {}
    for key, calls in value.get("behaviours", {}).items():
        if not isinstance(calls, list) or not calls:
            raise ValueError(f"behaviours/{key}: a list with one object per call is expected.")
        found[key] = tuple(_behaviours(key, calls))
    return Script(found)


def _behaviours(key: str, calls: list[object]) -> Iterable[Behaviour]:
    known = set(Behaviour.__struct_fields__)
    for index, call in enumerate(calls):
        place = f"behaviours/{key}/{index}"
        if not isinstance(call, dict):
            raise ValueError(f"{place}: an object is expected.")
        if unknown := sorted(map(str, call.keys() - known)):
            raise ValueError(f"{place}: there is no {', '.join(unknown)}.")
        given = {field: member for field, member in call.items() if member is not None}
        try:
            behaviour = msgspec.convert(given, Behaviour)
        except msgspec.ValidationError as e:
            raise ValueError(f"{place}: {e}") from None
        if behaviour.result not in OUTCOMES:
            raise ValueError(f"{place}/result: one of {', '.join(OUTCOMES)} is expected.")
        times = behaviour.after_s, behaviour.stop_s, behaviour.load_s
        if not all(0 <= time < 1e9 for time in times):
            raise ValueError(f"{place}: times are seconds, not negative.")
        yield behaviour
