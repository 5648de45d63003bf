"""Tables of measurements, printed as Markdown."""

import sys
from collections.abc import Sequence
from typing import NamedTuple


class Table(NamedTuple):
    """Head and rows; the first column is text."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]


def show(table: Table) -> None:
    """Prints a table with columns of equal width."""
    lines = [table.head, *table.rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.head))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    for line in (table.head, rule, *table.rows):
        cells = [
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        sys.stdout.write(f"| {' | '.join(cells)} |\n")
        sys.stdout.flush()


def seconds(value: float) -> str:
    """A duration with its unit."""
    if value < 0.001:
        return f"{value * 1e6:.0f} µs"
    return f"{value * 1e3:.1f} ms" if value < 1 else f"{value:.2f} s"
