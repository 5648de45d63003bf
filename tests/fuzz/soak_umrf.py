"""atheris on the codec and the checks: `python tests/fuzz/soak_umrf.py [SECONDS] [CORPUS…]`.

Wants `pip install atheris`. Starts from our examples, and from the folders named. A failing input is
written as `crash-…` into the current folder; put it into `tests/fuzz/kept`, where it becomes a test.
"""

import json
import random
import sys
from pathlib import Path
from tempfile import mkdtemp

import atheris

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "server"), str(Path(__file__).parent)]
with atheris.instrument_imports(include=["action_assistant.umrf"]):
    from umrf_mutations import mutated
    from umrf_target import examine

SEEDS = (
    ROOT / "server" / "action_assistant" / "examples",
    ROOT / "tests" / "umrf" / "examples",
    ROOT / "tests" / "fuzz" / "kept",
)


def one(data: bytes) -> None:
    """One input: as it is, and read as JSON whose values were exchanged."""
    examine(data)


def mutate(data: bytes, max_size: int, seed: int) -> bytes:
    """A change of the JSON value where there is one, else of the bytes."""
    chance = random.Random(seed)
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return bytes(atheris.Mutate(data, max_size))
    if chance.random() < 0.2:
        return bytes(atheris.Mutate(data, max_size))
    return json.dumps(mutated(value, chance)).encode(errors="surrogatepass")[:max_size]


def main(arguments: list[str]) -> None:
    """Runs until the time is over or something fails."""
    seconds = arguments[0] if arguments else "300"
    folders = [str(folder) for folder in SEEDS if folder.is_dir()] + arguments[1:]
    options = [f"-max_total_time={seconds}", "-max_len=20000", "-timeout=60", "-rss_limit_mb=2000"]
    atheris.Setup(
        [sys.argv[0], *options, mkdtemp(prefix="soak-"), *folders], one, custom_mutator=mutate
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1:])
