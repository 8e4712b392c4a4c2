"""Text in columns."""

from collections.abc import Iterable, Iterator


def aligned(rows: Iterable[Iterable[str]], indent: str = "") -> Iterator[str]:
    """Align the cells of each column; one line for each row."""
    table = [[str(cell) for cell in row] for row in rows]
    columns = max((len(row) for row in table), default=0)
    widths = [max((len(row[column]) for row in table if column < len(row)), default=0) for column in range(columns)]
    for row in table:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        yield f"{indent}{'  '.join(cells)}".rstrip()
