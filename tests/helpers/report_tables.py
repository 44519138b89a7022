"""Tables of a report, read by their headings."""

from clearway.experiments.section import ReportTable, Value


def by_heading(table: ReportTable) -> list[dict[str, Value]]:
    """Its rows, each as values by heading."""
    return [dict(zip(table.headings, row, strict=True)) for row in table.rows]
