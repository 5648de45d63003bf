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
    sys.stdout.write("\n".join((*lines(table), "")))
    sys.stdout.flush()


def lines(table: Table) -> list[str]:
    """A table as Markdown with columns of equal width."""
    rows = [table.head, *table.rows]
    widths = [max(len(row[i]) for row in rows) for i in range(len(table.head))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return [
        "| "
        + " | ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        + " |"
        for row in (table.head, rule, *table.rows)
    ]


def seconds(value: float) -> str:
    """A duration with its unit."""
    if value < 0.001:
        return f"{value * 1e6:.0f} µs"
    return f"{value * 1e3:.1f} ms" if value < 1 else f"{value:.2f} s"
