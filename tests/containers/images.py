"""Makes the images: bases out of Debian's packages, then those of our own Dockerfile, by compose.

    python -m containers.images [--bases-only]

Told are how long each took and how large it is, beside its base.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from containers.engine import FOLDER, ROOT, inspect, podman, run

BASES: Final = Path(__file__).parent / "bases"
SUITES: Final = ("bookworm", "trixie")
#: A stage of bases/Dockerfile for each image that is named as a base.
STANDS_IN: Final = {
    "python": "python:3.12.11-slim-bookworm",
    "node": "node:22.16.0-bookworm-slim",
    "caddy": "caddy:2.10.0",
    "postgres": "postgres:17.5-bookworm",
    "ros-core": "ros:jazzy-ros-core-noble",
    "ros-base": "ros:jazzy-ros-base-noble",
}
VERSION: Final = (
    subprocess.run(
        [sys.executable, ROOT / "scripts" / "build_version.py"],
        capture_output=True,
        text=True,
        check=True,
    )
    .stdout.strip()
    .replace("+", "-")
)
os.environ["IMAGE_VERSION"] = VERSION  # whatever compose does here is about these images
EDITOR: Final = f"temoto-action-assistant/editor:{VERSION}"
RUNNER: Final = f"temoto-action-assistant/runner:{VERSION}"
#: The commit from which the images say that they are built.
COMMIT: Final = run("git", "rev-parse", "HEAD").stdout.strip()
#: The first commit whose images have a tag of their own; its tables are older than those of today.
EARLIER: Final = "bbf37f33b"
_CERTIFICATES: Final = Path("/etc/ssl/certs/ca-certificates.crt")
_FOLDER_IN: Final = re.compile(r"(?:file://)?(/[^\s'\"]+)")


def say(text: str) -> None:
    """A line for whoever waits."""
    sys.stdout.write(f"» {text}\n")
    sys.stdout.flush()


def pip_settings() -> dict[str, str]:
    """Return pip's settings for reaching PyPI; the environment wins, as it does for pip."""
    said = subprocess.run(
        [sys.executable, "-m", "pip", "config", "list"], capture_output=True, text=True, check=True
    )
    found = {}
    for scope in ("global", ":env:"):
        for name, value in re.findall(rf"^{scope}\.([\w-]+)='(.*)'$", said.stdout, re.MULTILINE):
            found[name] = value
    found.pop("constraint", None)
    return found


def folders() -> Iterator[Path]:
    """Return the folders with wheels on this machine's disk, also those beside an index
    (…/simple)."""
    for name in ("find-links", "extra-index-url", "index-url"):
        for text in _FOLDER_IN.findall(pip_settings().get(name, "")):
            folder = Path(text.removesuffix("/").removesuffix("/simple"))
            if folder.is_dir():
                yield folder


def reach() -> list[str]:
    """Options of a build: the network of this machine, its wheels, and no registry."""
    wheels = (f"--volume={folder}:{folder}:ro" for folder in folders())
    return ["--network=host", "--format=docker", "--layers", "--pull=never", *wheels]


def make_bases() -> None:
    """One image for each name, and how long it took."""
    for suite in SUITES:
        root = FOLDER / f"{suite}.tar"
        if not root.exists():
            part = root.with_suffix(".part")
            # What is broken off begins anew, so nothing has to be on the disk at once.
            run("mmdebstrap", "--quiet", "--variant=apt", "--format=tar",
                "--dpkgopt=force-unsafe-io", "--include=ca-certificates",
                suite, part, timeout=3600)  # fmt: skip
            part.rename(root)
        if run("podman", "image", "exists", f"debian-{suite}", check=False).returncode:
            podman("import", root, f"debian-{suite}")
    context = FOLDER / "bases"
    shutil.rmtree(context, ignore_errors=True)
    machine = context / "machine"
    (machine / "etc/ssl/certs").mkdir(parents=True)
    shutil.copy(_CERTIFICATES, machine / "etc/ssl/certs")
    lines = [f"{name} = {value}" for name, value in pip_settings().items()]
    (machine / "etc/pip.conf").write_text("\n".join(["[global]", *lines, ""]))
    shutil.copytree(BASES, context / "bases")
    for name in ("requirements/ros.txt", "scripts/build-messages"):
        (context / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, context / name)
    for stage, name in STANDS_IN.items():
        begun = time.monotonic()
        podman("build", *reach(), "--target", stage, "--tag", name,
               "--file", BASES / "Dockerfile", context, timeout=3600)  # fmt: skip
        say(f"{name} stood in for: {time.monotonic() - begun:.0f} s, {size(name)} MB")


def compose_build(
    *services: str, folder: Path = ROOT, version: str = VERSION, commit: str = COMMIT
) -> float:
    """The images that compose names; how many seconds it took. `folder`: the checkout from which they
    are built."""
    begun = time.monotonic()
    command = ["podman-compose", "--podman-build-args", " ".join(reach())]
    for profile in ("simulator", "robot"):
        command += ["--profile", profile]
    more = {"SOURCE_COMMIT": commit, "IMAGE_VERSION": version}
    run(*command, "build", *services, timeout=3600, cwd=folder, more=more)
    return time.monotonic() - begun


def compose_build_earlier(*services: str) -> float:
    """Build the images of the commit `EARLIER`, and return how many seconds it took."""
    folder = FOLDER / "earlier"
    if not folder.exists():
        run("git", "clone", "--quiet", ROOT, folder)
        run("git", "checkout", "--quiet", EARLIER, cwd=folder)
    told = run(sys.executable, "scripts/build_version.py", "env", cwd=folder).stdout
    lines = dict(line.split("=", 1) for line in told.splitlines())
    commit = lines["SOURCE_COMMIT"]
    return compose_build(*services, folder=folder, version=lines["IMAGE_VERSION"], commit=commit)


def earlier_version() -> str:
    """Return the tag of the images that `compose_build_earlier` made last."""
    lines = podman("images", "--format", "{{.Tag}}", "temoto-action-assistant/editor").split()
    (found,) = [each for each in lines if each.endswith(EARLIER[:8])]
    return found


def size(name: str) -> int:
    """Return the size of an image in MB."""
    return round(int(inspect(name)["Size"]) / 1e6)


def make() -> None:
    """Build the base images and, without `--bases-only`, ours."""
    make_bases()
    if "--bases-only" in sys.argv:
        return
    for service, base in (("editor", STANDS_IN["python"]), ("runner", STANDS_IN["ros-core"])):
        seconds = compose_build(service)
        name = {"editor": EDITOR, "runner": RUNNER}[service]
        say(f"{name}: {seconds:.0f} s, {size(name)} MB, {size(name) - size(base)} over its base")
    say(f"both images of {EARLIER}: {compose_build_earlier('editor', 'runner'):.0f} s")


if __name__ == "__main__":
    os.nice(5)
    make()
