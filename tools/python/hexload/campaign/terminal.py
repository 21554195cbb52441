"""Tables on the terminal, also on one of 80 letters."""

import sys
from collections.abc import Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.table import Column, Table

BETWEEN = 2  # letters between columns
WORDS = 24  # of a column whose cells may take several lines


def console(width: int) -> Console:
    """`width`: where there is no terminal to ask."""
    return Console(width=None if sys.stdout.isatty() else width)


def in_parts(table: Table, width: int) -> list[Table]:
    """The table, or, where it is wider, its columns in several tables, each after the first column."""
    first, *others = table.columns
    groups: list[list[Column]] = [[]]
    used = _width(first)
    for column in others:
        if groups[-1] and used + _width(column) > width:
            groups.append([])
            used = _width(first)
        groups[-1].append(column)
        used += _width(column)
    if len(groups) == 1:
        return [table]
    return [_part(table, [first, *group], table.title if not k else None) for k, group in enumerate(groups)]


def _width(column: Column) -> int:
    widest = max(cell_len(line) for cell in (column.header, *column.cells) for line in str(cell).splitlines() or [""])
    return BETWEEN + (widest if column.no_wrap else min(widest, WORDS))


def _part(table: Table, columns: Sequence[Column], title: object) -> Table:
    part = Table(title=title, title_justify="left", box=table.box, padding=table.padding)
    for column in columns:
        part.add_column(column.header, justify=column.justify, no_wrap=column.no_wrap)
    for row, cells in zip(table.rows, zip(*(column.cells for column in columns))):
        part.add_row(*cells, style=row.style, end_section=row.end_section)
    return part
