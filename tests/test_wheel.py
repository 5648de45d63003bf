"""The wheel in an empty environment: it brings the page and the migrations, and needs no Node.

It is built, installed and asked for its health by the very steps of the container images.
"""

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from tempfile import mkdtemp

import httpx
import pytest

from support.product import TOKEN, Product, running

ROOT = Path(__file__).parents[1]
IMAGE = ROOT / "scripts" / "image"


def healthy(part: str, port: int) -> bool:
    """Return the result of an image's health check for a server on this port and the next."""
    environment = os.environ | {"ACTION_ASSISTANT_PORT": str(port)}
    asked = subprocess.run(
        [IMAGE, "healthy", part], env=environment, capture_output=True, check=False
    )
    return asked.returncode == 0


def tools_in(environment: Path) -> set[str]:
    """Return the tools for building, installing or testing that an environment can import."""
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
    back_end = tmp_path_factory.mktemp("back-end")
    subprocess.run([IMAGE, "back-end", back_end], cwd=ROOT, check=True)
    subprocess.run([IMAGE, "wheel", back_end, folder], cwd=ROOT, check=True)
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


def test_the_wheel_says_which_commit_it_was_built_from(wheel: Path) -> None:
    """The commit ends with a plus where files were changed since."""
    carried = zipfile.ZipFile(wheel).read("action_assistant/commit.txt").decode().strip()
    asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    head = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    assert carried.removesuffix("+") == head


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
        ".txt",
        ".jinja",
    }
    assert {each.parts[1] for each in outside if each.suffix in {".json", ".jsonl"}} == {"examples"}
    assert {each.parent.name for each in outside if each.suffix == ".jinja"} == {"templates"}
    assert not {each.suffix for each in names} & {".map", ".ts", ".tsx", ".mako", ".pyc"}
    assert not [each for each in names if "test" in each.name or "tests" in each.parts]


def _bare_environment(folder: Path) -> dict[str, str]:
    """Return an environment without tools, and with modules of another workspace, as a sourced
    ROS 2 brings them."""
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


BUILDER = (sys.executable, "-m", "hatchling", "build")
#: What a wheel of a few lines needs, made by the same configuration.
BUILDS = (
    *("pyproject.toml", "README.md", "LICENSE", "scripts/build_version.py"),
    *("scripts/wheel_commit.py", "server/action_assistant/version.py"),
)
IDENTITY = ("-c", "user.name=Ann", "-c", "user.email=ann@example.org")


def git(folder: Path, *arguments: str) -> str:
    command = ["git", *IDENTITY, "-C", str(folder), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A repository of one commit and no tags with a package that is built as this one."""
    folder = tmp_path / "small"
    for name in (*BUILDS, "frontend/dist/index.html", "build/help/index.html"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file() and name in BUILDS:
            shutil.copy(ROOT / name, folder / name)
        else:
            (folder / name).write_text("built")
    for name in ("server/action_assistant/__init__.py", "migrations/env.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    (folder / ".gitignore").write_text("dist/\nbuild/\n")
    git(folder, "init", "--quiet", "--initial-branch=main")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "one")
    return folder


def built(folder: Path, kind: str) -> Path:
    """Build a package of a kind in a repository, and return its file."""
    out = Path(mkdtemp(dir=folder.parent))
    subprocess.run([*BUILDER, "-t", kind, "-d", str(out)], cwd=folder, check=True)
    (found,) = out.iterdir()
    return found


def says(folder: Path, **environment: str) -> str:
    """Return the version that would be built in a folder."""
    command = [sys.executable, str(folder / "scripts" / "build_version.py")]
    answer = subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return answer.stdout.strip()


def test_pip_upgrades_to_the_wheel_of_a_newer_commit_and_back(small: Path, tmp_path: Path) -> None:
    """The command is that of docs/installing.md."""
    assert "pip: `install --upgrade`" in (ROOT / "docs" / "installing.md").read_text()
    older = built(small, "wheel")
    (small / "server" / "action_assistant" / "__init__.py").write_text("NEW = 1")
    git(small, "commit", "--quiet", "--all", "--message", "two")
    newer, head = built(small, "wheel"), git(small, "rev-parse", "HEAD")
    base = says(small).partition("+")[0]
    assert base.endswith(".dev2")
    assert newer.name == f"temoto_action_assistant-{base}+g{head[:8]}-py3-none-any.whl"
    environment = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    python = str(environment / "bin" / "python")
    shown = []
    for wheel in (older, newer, older):
        subprocess.run(
            [
                sys.executable,
                "-m",
                "pip",
                "--python",
                python,
                "install",
                "--quiet",
                "--upgrade",
                wheel,
            ],
            env=os.environ | {"PIP_NO_DEPS": "1"},
            check=True,
        )
        text = "from importlib.metadata import version; print(version('temoto-action-assistant'))"
        asked = subprocess.run([python, "-c", text], capture_output=True, text=True, check=True)
        shown.append(asked.stdout.strip())
    assert shown == [each.name.split("-")[1] for each in (older, newer, older)]


def test_a_source_package_an_image_and_a_clone_without_history_know_their_version(
    small: Path, tmp_path: Path
) -> None:
    version = says(small)
    with tarfile.open(built(small, "sdist")) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    assert says(unpacked) == version
    git(small, "commit", "--quiet", "--allow-empty", "--message", "two")
    git(tmp_path, "clone", "--quiet", "--depth=1", f"file://{small}", "shallow")
    head = git(small, "rev-parse", "HEAD")[:8]
    assert says(tmp_path / "shallow").endswith(f".dev0+g{head}")
    shutil.rmtree(small / ".git")
    assert says(small).endswith(".dev0")
    assert says(small, SOURCE_VERSION=version.replace("+", "-")) == version
    (small / "pyproject.toml").write_text('version = "1.2.3"')
    assert says(small) == "1.2.3"


@pytest.mark.long
@pytest.mark.timeout(300)
def test_an_installed_wheel_serves_the_page_without_node(wheel: Path, tmp_path: Path) -> None:
    environment, package = tmp_path / "venv", tmp_path / "package"
    lock = ROOT / "requirements" / "run.txt"
    subprocess.run([IMAGE, "dependencies", environment, lock], check=True)
    subprocess.run([IMAGE, "package", environment, wheel.parent, package], check=True)
    shutil.copytree(package, environment, dirs_exist_ok=True)  # as COPY in the Dockerfile does
    assert tools_in(environment) == set()
    assert not [each for each in environment.rglob("tests") if each.is_dir()]
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
        assert all(healthy(part, product.port) for part in ("editor", "runner", "serve"))
    finally:
        process.terminate()
        process.communicate(timeout=20)
    assert not any(healthy(part, product.port) for part in ("editor", "runner", "serve"))


def test_a_slow_process_is_asked_by_one_scheme_only() -> None:
    with socket.create_server(("127.0.0.1", 0)) as slow:
        assert not healthy("editor", slow.getsockname()[1])
        slow.settimeout(0.1)
        asked = []
        with contextlib.suppress(TimeoutError):
            while True:
                connection, _ = slow.accept()
                with connection:
                    asked.append(connection.recv(4))
    assert asked == [b"GET "], "bytes of TLS would be a warning in its log"


def test_the_health_check_knows_tls(tmp_path: Path) -> None:
    with running(tmp_path / "data", "--share", "--tls") as product:
        assert healthy("serve", product.port)
