"""Generates the files of an action package from the description of its action."""

from functools import cache
from pathlib import Path
from typing import Any, Final

import msgspec
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from action_assistant.umrf.files.action_files import write_action
from action_assistant.umrf.files.older_dialects import RELATIONS
from action_assistant.umrf.model import Action
from action_assistant.umrf.packages import escapes
from action_assistant.umrf.packages.naming import NameRefusal, check_name, snake_case
from action_assistant.umrf.packages.structures import ParameterStruct, structure

_TEMPLATES: Final = Path(__file__).with_name("templates")
_CPP: Final = "cpp"
#: Template and language by path; `{}` is the name of the package.
_FILES: Final = {
    ".clang-format": ("clang_format", "yaml"),
    "CMakeLists.txt": ("cmake_lists", "cmake"),
    "README.md": ("readme", "markdown"),
    "include/{}/input_parameters.hpp": ("input_parameters", _CPP),
    "include/{}/output_parameters.hpp": ("output_parameters", _CPP),
    "include/{}/temoto_action.hpp": ("temoto_action", _CPP),
    "package.xml": ("package", "xml"),
    "src/{}.cpp": ("action", _CPP),
    "test/{}_test.cpp": ("trial", _CPP),
}


#: The folders of sources that are generated once, for people to continue.
_SOURCES: Final = ("src/", "test/")


class ImpossiblePackage(Exception):
    """Raised if there can be no package of the action; `refusals` are the reasons."""

    def __init__(self, refusals: tuple[NameRefusal, ...]) -> None:
        super().__init__(" ".join(refusal.sentence for refusal in refusals))
        self.refusals = refusals


def package_files(action: Action) -> dict[str, bytes]:
    """Return the files of an action's package: contents by path (with `/`) below its folder
    `naming.snake_case(action.name)`. Raise `ImpossiblePackage` if a name or parameter cannot be
    one of C++ or ROS."""
    refusals = check_name(action.name)
    inputs, against_inputs = structure(action, "input_parameters")
    outputs, against_outputs = structure(action, "output_parameters")
    if refusals := (*refusals, *against_inputs, *against_outputs):
        raise ImpossiblePackage(refusals)
    package = snake_case(action.name)
    known = {
        "package": package,
        "namespace": f"{package}_action",
        "name": action.name,
        "description": action.description.strip() or f"The action {action.name}.",
        "inputs": inputs,
        "outputs": outputs,
    }
    found = {
        path.format(package): rendered(template, language, known)
        for path, (template, language) in _FILES.items()
        if _wanted(template, inputs, outputs)
    }
    found[f"{package}.umrf.json"] = write_action(_described(action)).encode()
    return dict(sorted(found.items()))


def possible_files(package: str) -> frozenset[str]:
    """Return all paths that `package_files` may have for a package of this name."""
    return frozenset(path.format(package) for path in (*_FILES, "{}.umrf.json"))


def is_source(path: str) -> bool:
    """Return whether a generated file is source code or a test, which people edit. `path`: its
    place in the package."""
    return path.startswith(_SOURCES)


def _wanted(template: str, inputs: ParameterStruct, outputs: ParameterStruct) -> bool:
    sides = {"input_parameters": inputs, "output_parameters": outputs}
    return template not in sides or bool(sides[template].values)


def _described(action: Action) -> Action:
    """Return the action apart from any graph: without number, actor, position and relations."""
    extra = tuple((k, v) for k, v in action.extra if k not in {*RELATIONS, "instance_id"})
    return msgspec.structs.replace(action, instance_id=0, actor="", position=None, extra=extra)


def rendered(template: str, language: str, known: dict[str, Any]) -> bytes:
    """Return the text of a template of a language, in UTF-8, with the variables `known`."""
    text = environment(language).get_template(f"{template}.jinja").render(known)
    return text.encode()


@cache
def environment(language: str) -> Environment:
    """Return the environment of Jinja that renders templates of a language. A value of a type that
    is not in `escapes.ACCEPTED` raises TypeError, a missing value raises UndefinedError."""
    made = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=False,
        finalize=escapes.only(language),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,
    )
    made.filters |= {
        "cpp_name": escapes.cpp_name,
        "cpp_type": escapes.cpp_type,
        "cpp_string": escapes.cpp_string,
        "cpp_initial": escapes.cpp_initial,
        "cpp_comment": escapes.cpp_comment,
        "package_name": escapes.package_name,
        "cmake": escapes.cmake,
        "xml": escapes.xml,
        "markdown": escapes.markdown,
        "blanks": escapes.blanks,
    }
    return made
