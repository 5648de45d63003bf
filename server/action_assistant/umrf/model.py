"""The values of a UMRF graph: frozen structs for graphs, actions, relations and problems.

Shapes follow the file format (docs/umrf-and-the-engine.md 1), with two differences that make values
easy to edit and to merge: relations stand beside the actions instead of being written twice, and
both refer to actions by `key`, never by name. `ENTRY` and `EXIT` are the keys of the graph's two
ends.

Raw JSON text is kept wherever its spelling matters (`5` against `5.0`, order of members, unknown
fields).
"""

from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.safe_text import hold_names

Key: TypeAlias = str
JsonText: TypeAlias = str
Position: TypeAlias = tuple[float, float]
Precondition: TypeAlias = Literal["on_true", "on_false", "on_error", "on_stopped"]
Response: TypeAlias = Literal["run", "pause", "restart", "stop", "bypass", "ignore"]
Result: TypeAlias = Literal["on_true", "on_false", "on_error", "on_stopped", "on_halted"]
Severity: TypeAlias = Literal["error", "warning"]
Direction: TypeAlias = Literal["right", "down"]

ENTRY: Final = "entry"
EXIT: Final = "exit"
PRECONDITIONS: Final[tuple[Precondition, ...]] = ("on_true", "on_false", "on_error", "on_stopped")
#: The outcomes with which an action can end by itself; `on_stopped` needs a stop.
OUTCOMES: Final[tuple[Precondition, ...]] = ("on_true", "on_false", "on_error")
RESPONSES: Final[tuple[Response, ...]] = ("run", "pause", "restart", "stop", "bypass", "ignore")


class Conditions(msgspec.Struct, frozen=True):
    """The child's response to each outcome of its parent. The response to an outcome that is not
    set is `ignore`."""

    on_true: Response = "ignore"
    on_false: Response = "ignore"
    on_error: Response = "ignore"
    on_stopped: Response = "ignore"

    def answer(self, outcome: Precondition) -> Response:
        """Return the child's response to this outcome of its parent."""
        answer: Response = getattr(self, outcome)
        return answer


#: The responses that the engine assumes for conditions that a file leaves out (docs/umrf-and-the-engine.md 1.4).
ENGINE_DEFAULTS: Final = Conditions("run", "run", "bypass", "ignore")
#: The only conditions that a relation of the entry can have.
ENTRY_CONDITIONS: Final = Conditions("run")


class Parameter(msgspec.Struct, frozen=True):
    """One leaf of `input_parameters` or `output_parameters`.

    `path` joins the keys that lead to it with `/`; inside a key `~` is `~0` and `/` is `~1`.
    `text` is the value as written, usually an object with `pvf_type`.
    """

    path: str
    text: JsonText


class Action(msgspec.Struct, frozen=True, kw_only=True):
    """An action of the graph. Its full name on the wire is `name_instance_id`.

    `missing`: relations name it and the file has no such action (it is drawn as a ghost and never
    written). `twin`: it has the full name of an earlier action of its file, and keeps it. `extra`:
    fields that this model does not know, and known ones whose value does not fit; the latter
    replace the field when the graph is written. `asks`: the inputs, by path, that a start asks for
    because the author marks them, each with its mark as JSON text.
    `breakpoint`: JSON text, "" for none; no file has it.
    """

    key: Key
    name: str
    instance_id: int = 0
    type: str = "sync"
    actor: str = ""
    description: str = ""
    inputs: tuple[Parameter, ...] = ()
    outputs: tuple[Parameter, ...] = ()
    position: Position | None = None
    missing: bool = False
    twin: bool = False
    extra: tuple[tuple[str, JsonText], ...] = ()
    asks: tuple[tuple[str, JsonText], ...] = ()
    breakpoint: JsonText = ""

    @property
    def full_name(self) -> str:
        """The name by which the engine knows the action: its name, `_`, and its number."""
        return f"{self.name}_{self.instance_id}"


class Remap(msgspec.Struct, frozen=True):
    """An output of the parent that reaches the child under another name (flat names, `::`)."""

    source: str
    target: str


class Relation(msgspec.Struct, frozen=True, kw_only=True):
    """An arrow: the responses of `child` when `parent` ends.

    `parent` may be `ENTRY`, `child` may be `EXIT`. `listing` numbers the pairs that a file lists
    more than once, from 0. `only` names the one array that has it when a file lists one side only.
    `parent_order` is its position in the parent's `children`, `child_order` in the child's
    `parents` (for the ends: in `graph_entry` and `graph_exit`); ties are ordered by key.
    `waypoints`: by response, in the order of `RESPONSES`, the JSON text of the points through which
    people have led its line. `breakpoint`: as of an action.
    """

    parent: Key
    child: Key
    listing: int = 0
    conditions: Conditions = Conditions()
    required: bool = True
    remap: tuple[Remap, ...] = ()
    only: Literal["parents", "children"] | None = None
    parent_order: float = 0.0
    child_order: float = 0.0
    parents_extra: tuple[tuple[str, JsonText], ...] = ()
    children_extra: tuple[tuple[str, JsonText], ...] = ()
    waypoints: tuple[tuple[Response, JsonText], ...] = ()
    breakpoint: JsonText = ""


class Graph(msgspec.Struct, frozen=True, kw_only=True):
    """A whole task. `actions` are in file order; the order of `relations` has no meaning.

    `direction`: the side on which later actions are drawn; a graph without one is drawn top down.
    `notes`: (id, JSON text) of notes and frames on the canvas.
    """

    name: str
    description: str = ""
    actions: tuple[Action, ...] = ()
    relations: tuple[Relation, ...] = ()
    entry_position: Position | None = None
    exit_position: Position | None = None
    direction: Direction = "down"
    notes: tuple[tuple[str, JsonText], ...] = ()
    extra: tuple[tuple[str, JsonText], ...] = ()


class Where(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The place of a problem or note. `path` is a JSON pointer into the text that was given, or
    into the canonical text of a graph that was not read from a text.

    `line` and `column` (in characters, both from 1) are present if that text is known: the value
    begins there, with its key if it has one.
    """

    path: str = ""
    aid: Key | None = None
    relation: str | None = None
    line: int | None = None
    column: int | None = None


class PlaceInside(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The place of a problem within a sub-graph.

    `levels` are the full names of the actions that lead there and `aids` their ids: from the action
    of the graph around it, down to the one that stands for `graph`. `where` is in the text of that
    graph, whose own problem has this `code` and `message`.
    """

    levels: tuple[str, ...]
    aids: tuple[Key, ...]
    graph: str
    code: str
    message: str
    where: Where = Where()

    def __post_init__(self) -> None:
        hold_names(self, "message")


class Problem(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A fact about a graph that a person should know. Checks return problems and never raise.

    `also`: the other places of the same problem, which is reported once. `inside`: its place within
    a sub-graph.
    """

    code: str
    severity: Severity
    where: Where
    message: str
    fix: str | None = None
    also: tuple[Where, ...] = ()
    inside: PlaceInside | None = None

    def __post_init__(self) -> None:
        hold_names(self, "message", "fix")


class Note(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A remark on something in a text that was translated or dropped when it was read. `times`: how
    often that was; `where`: the first place; `also`: the others (the first thousand of them)."""

    message: str
    where: Where
    times: int = 1
    also: tuple[Where, ...] = ()

    def __post_init__(self) -> None:
        hold_names(self, "message")

    @property
    def sentence(self) -> str:
        """The message as a sentence, with the number of times if it applies to more than one value."""
        return f"{self.message} ({self.times} times)" if self.times > 1 else self.message


class Signature(msgspec.Struct, frozen=True, kw_only=True):
    """The parameters of one action in a library. Keys are flat parameter names (`pose::x`), values
    are types.

    `optional`: inputs that the action can do without.
    """

    inputs: dict[str, str] = {}
    outputs: dict[str, str] = {}
    optional: frozenset[str] = frozenset()
