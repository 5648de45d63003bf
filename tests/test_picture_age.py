"""The rule by which pictures of the documents count as older than the page (`bench/picture_age.py`)."""

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "bench" / "picture_age.py"


@pytest.fixture
def digest_of() -> Callable[[Path], str]:
    """Return the function of the script, which is in no package."""
    spec = importlib.util.spec_from_file_location("picture_age", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Callable[[Path], str] = module.digest_of
    return found


@pytest.mark.parametrize(
    ("name", "text", "is_same"),
    [
        ("button.tsx", "/** A big button. */\nconst b =\n  <b>Go</b>;\n// the end\n", True),
        ("button.test.tsx", "test('it');", True),
        ("names.ts", "export const name = 1;", True),
        ("button.tsx", "const b = <b>Stop</b>;", False),
        ("button.css", "b { color: red; }", False),
    ],
)
def test_only_components_and_styles_make_pictures_older(
    digest_of: Callable[[Path], str], tmp_path: Path, name: str, text: str, is_same: bool
) -> None:
    (tmp_path / "button.tsx").write_text("const b = <b>Go</b>;")
    before = digest_of(tmp_path)
    (tmp_path / name).write_text(text)
    assert (digest_of(tmp_path) == before) is is_same
