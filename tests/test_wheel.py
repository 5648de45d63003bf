"""The wheel in an empty environment: it brings the page and the migrations, and needs no Node.

It is built, installed and asked for its health by the very steps of the container images.
"""

import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import httpx
import pytest

from support.product import TOKEN, Product

ROOT = Path(__file__).parents[1]
IMAGE = ROOT / "scripts" / "image"


def healthy(port: int) -> bool:
    """What the health check of an image would say."""
    asked = subprocess.run([IMAGE, "healthy", str(port)], capture_output=True, check=False)
    return asked.returncode == 0


def tools_in(environment: Path) -> set[str]:
    """What builds, installs or tests packages, of all that an environment can import."""
    (packages,) = environment.glob("lib/python3*/site-packages")
    tools = {"pip", "setuptools", "wheel", "hatchling", "editables", "pytest", "hypothesis", "mypy"}
    return tools & {each.name for each in packages.iterdir()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout, with the page that was built last."""
    built = [ROOT / each / "index.html" for each in ("frontend/dist", "build/help")]
    if not all(each.is_file() for each in built):
        pytest.skip("the page is not built; `make setup` builds it")
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([IMAGE, "wheel", folder], cwd=ROOT, check=True)
    (found,) = folder.glob("*.whl")
    return found


def test_the_wheel_carries_page_help_and_migrations_and_nothing_foreign(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert "action_assistant/static/index.html" in names
    assert "action_assistant/help/operators-guide.html" in names
    assert "action_assistant/migrations/env.py" in names
    assert any(name.startswith("action_assistant/examples/") for name in names)
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"action_assistant"}


def test_the_wheel_carries_neither_tests_nor_what_builds(wheel: Path) -> None:
    names = [Path(name) for name in zipfile.ZipFile(wheel).namelist()]
    outside = [
        each
        for each in names
        if not {"static", "help"} & {*each.parts} and "dist-info" not in str(each)
    ]
    assert {each.suffix for each in outside} == {
        ".py",
        ".json",
        ".jsonl",
        ".typed",
        ".jinja",
    }
    assert {each.parts[1] for each in outside if each.suffix in {".json", ".jsonl"}} == {"examples"}
    assert {each.parent.name for each in outside if each.suffix == ".jinja"} == {"templates"}
    assert not {each.suffix for each in names} & {".map", ".ts", ".tsx", ".mako", ".pyc"}
    assert not [each for each in names if "test" in each.name or "tests" in each.parts]


def _bare_environment(folder: Path) -> dict[str, str]:
    """Without any tool, and with modules of another workspace, as a sourced ROS 2 brings them."""
    tools, harmful = folder / "bin", folder / "sourced"
    tools.mkdir()
    harmful.mkdir()
    for name in ("litestar", "msgspec", "sqlalchemy"):
        (harmful / f"{name}.py").write_text("raise ImportError('of another workspace')")
    return {
        "PYTHONPATH": str(harmful),
        "AMENT_PREFIX_PATH": str(folder),
        "PATH": str(tools),
        "HOME": str(folder),
        "ACTION_ASSISTANT_TOKEN": TOKEN,
        "LANG": os.environ.get("LANG", "C.UTF-8"),
    }


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_an_installed_wheel_serves_the_page_without_node(wheel: Path, tmp_path: Path) -> None:
    environment, files = tmp_path / "venv", tmp_path / "files"
    (files / "wheel").mkdir(parents=True)
    shutil.copy(wheel, files / "wheel")
    shutil.copy(ROOT / "requirements" / "run.txt", files)
    subprocess.run([IMAGE, "install", environment, files], check=True)
    assert tools_in(environment) == set()
    product = Product(tmp_path / "data")
    clean = _bare_environment(tmp_path)
    assert shutil.which("node", path=clean["PATH"]) is None
    command = [str(environment / "bin" / "action-assistant"), "serve", "--no-open"]
    process = subprocess.Popen(
        [*command, "--data", str(product.data), "--port", str(product.port)],
        env=clean,
        cwd=tmp_path,
        stderr=subprocess.PIPE,
    )
    try:
        assert process.stderr
        for line in process.stderr:
            if b"ready" in line:
                break
        page = httpx.get(product.url, headers={"accept": "text/html"}, trust_env=False)
        assert '<div id="root">' in page.text
        told = httpx.get(f"{product.url}/help/", trust_env=False)
        assert told.status_code == 200
        assert "Search" in told.text
        with product.editor() as editor:
            assert editor.get("/api/graphs").json()
        assert healthy(product.port)
        assert healthy(product.port + 1)
    finally:
        process.terminate()
        process.communicate(timeout=20)
    assert not healthy(product.port)
