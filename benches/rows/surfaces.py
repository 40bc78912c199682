"""The surfaces of the evenness rows and how isoswarm is given them; figures that are about quality, not speed."""

import json
from dataclasses import dataclass

import numpy as np

from options import ROOT, Options
from peers import fields, pipelines
from peers.evenness import evenness
from table import Row, number

GYROID_AREA = 122.053
"""Area of sin x cos y + sin y cos z + sin z cos x = 0 in a cube of side 2π."""


@dataclass(frozen=True)
class Case:
    """A field, where to look, its exact area, and whether the box clips it."""

    name: str
    field: object
    bounds: tuple
    area: float
    clipped: bool = False


def field(blobs: fields.Blobs) -> tuple:
    """isoswarm's field with the same formula as the peers' grid, and its bounds."""
    import isoswarm as iso

    return iso.gaussians(blobs.centers, blobs.radii, blobs.iso, blobs.k), blobs.bounds()


def cases() -> list[Case]:
    """Sphere, torus, blobs and a cell of the gyroid."""
    import isoswarm as iso

    blobs = fields.sixteen_blobs()
    areas = []
    for cell in (0.04, 0.02):
        values, corner = blobs.grid(cell)
        areas.append(pipelines.mesh_area(pipelines.marching_cubes(values, corner, cell)))
    made, bounds = field(blobs)
    pi = np.pi
    return [
        Case("sphere", iso.parse("x^2+y^2+z^2-1"), ([-1.25] * 3, [1.25] * 3), 4 * pi),
        Case("torus", iso.parse("(sqrt(x^2+y^2)-1)^2+z^2-.16"), ([-1.5] * 3, [1.5] * 3), 4 * pi * pi * 0.4),
        # The error of marching cubes falls with the square of the cell.
        Case("blobs", made, bounds, (4 * areas[1] - areas[0]) / 3),
        Case(
            "gyroid cell",
            iso.parse("sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)"),
            ([-pi] * 3, [pi] * 3),
            GYROID_AREA,
            clipped=True,
        ),
    ]


def evenness_rows(options: Options) -> list[Row]:
    """rho_min, rho_avg, CV and the six-valent part at n = 5000, and how far off the surface the samples lie."""
    import isoswarm as iso

    goals = [
        ("ρ_min", "rho_min", 0.80, 0.85, True),
        ("ρ_avg", "rho_avg", 0.92, 0.95, True),
        ("CV", "cv", 0.04, 0.03, False),
        ("six-valent", "six", 0.75, 0.85, True),
    ]
    rows, worst = [], []
    for case in cases():
        samples = iso.sample(case.field, n=5000, bounds=case.bounds)
        points, normals = samples.points, samples.normals
        lo, hi = np.asarray(case.bounds, dtype=float)
        inner = (np.minimum(points - lo, hi - points) > 1e-9 * np.linalg.norm(hi - lo)).all(axis=1)
        inner = inner if case.clipped else np.ones(len(points), dtype=bool)
        # Where the box clips the surface, the samples on its faces own a part of the area.
        area = float(samples.areas[inner].sum()) if case.clipped else case.area
        even = evenness(points, area, normals, inner)
        even["area_error"] = float(samples.areas.sum() / case.area - 1)
        value, gradient = case.field.value(points), case.field.gradient(points)
        off = np.abs(value) / np.linalg.norm(gradient, axis=1)
        extent = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
        worst.append((float(off.max()) / extent, case.name))
        options.log(f"{case.name}: {even}, off the surface {worst[-1][0]:.1e}, {samples.report.status}")
        for label, key, reach, beyond, more in goals:
            what = f"{label}, {case.name}, n = 5000"
            rows.append(Row(what, number(even[key]), "", even[key], "", reach, beyond, more=more, data=even))
    off, name = max(worst)
    what = "off-surface distance over the diameter"
    rows.append(Row(what, f"{off:.1e} ({name})", "", off, "", 1e-9, 1e-12, more=False))
    return rows


def component_rows(options: Options) -> list[Row]:
    """Components on every surface of models/surfaces.json that is not singular."""
    import isoswarm as iso

    surfaces = json.loads((ROOT / "models" / "surfaces.json").read_text())
    regular = [s for s in surfaces if "singular" not in s["tags"]]
    wrong, uncertain = [], []
    for s in regular:
        report = iso.sample(iso.parse(s["expr"]), n=5000, bounds=s["bbox"]).report
        if report.components != s["components"]:
            wrong.append(f"{s['name']} ({report.components} instead of {s['components']})")
        elif not report.certified:
            uncertain.append(s["name"])
    options.log(f"components: wrong {wrong}, not certified {uncertain}")
    data = {"wrong": wrong, "uncertain": uncertain}
    rows = []
    found = len(regular) - len(wrong)
    for what, count in (("found", found), ("certified", found - len(uncertain))):
        # Finding all of them is the first goal, certifying all of them the second.
        reach = 1.0 if what == "found" else 0.0
        text = f"{count} of {len(regular)}"
        name = f"surfaces whose components are {what}"
        rows.append(Row(name, text, "", count / len(regular), "", reach, 1.0, data=data))
    return rows
