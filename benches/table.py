"""A figure beside its peer and its goals, and the table of them."""

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass
class Row:
    """One line: what was measured, isoswarm's figure, the peer's, and how both compare.

    ``value`` and the goals ``reach`` and ``beyond`` are in ``unit``; where ``unit`` is "x" the value is the ratio peer
    over isoswarm. ``more``: larger is better. ``value=None``: not measured, ``note`` says why.
    """

    what: str
    isoswarm: str
    peer: str
    value: float | None
    unit: str
    reach: float
    beyond: float
    more: bool = True
    note: str = ""
    data: dict[str, Any] = field(default_factory=dict)

    @property
    def met(self) -> str:
        """Which goal is met: beyond, reach or no; "-" where nothing was measured."""
        if self.value is None:
            return "-"
        for name in ("beyond", "reach"):
            goal = getattr(self, name)
            if self.value >= goal if self.more else self.value <= goal:
                return name
        return "no"

    def record(self) -> dict[str, Any]:
        """For the JSON file."""
        return asdict(self) | {"met": self.met}


def number(value: float) -> str:
    """Three significant digits without an exponent where that is readable."""
    return f"{value:.3g}" if value == 0 or 1e-3 <= abs(value) < 1e5 else f"{value:.1e}"


def render(rows: list[Row]) -> str:
    """A Markdown table."""
    lines = [["what", "isoswarm", "peer", "ratio or value", "reach", "beyond", "met"]]
    for row in rows:
        sign = "≥ " if row.more else "≤ "
        unit = "" if not row.unit else f" {row.unit}"
        lines.append(
            [
                row.what,
                row.isoswarm,
                row.peer,
                row.note if row.value is None else number(row.value) + unit,
                sign + number(row.reach),
                sign + number(row.beyond),
                row.met,
            ]
        )
    widths = [max(len(line[c]) for line in lines) for c in range(len(lines[0]))]
    text = ["| " + " | ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)) + " |" for line in lines]
    text.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    return "\n".join(text)
