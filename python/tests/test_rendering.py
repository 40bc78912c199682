"""Pictures by ray casting, from Python and the shell."""

import numpy as np
import pytest
from typer.testing import CliRunner

import isoswarm as iso
from isoswarm.cli import app
from isoswarm.cli.render import plane

SMALL = {"width": 96, "height": 72, "supersampling": 2}
BALL = iso.sphere(r=1)


def cover(image: iso.Image) -> float:
    """Pixels that are not background."""
    return float(image.array[..., 3].sum()) / 255


def test_a_picture_is_bytes_and_pixels(tmp_path):
    image = iso.render(BALL, tmp_path / "ball.png", **SMALL)
    assert image.array.shape == (72, 96, 4)
    assert image.array.dtype == np.uint8
    assert (tmp_path / "ball.png").read_bytes() == image == image._repr_png_()
    assert image.certified
    assert np.array_equal(iso.render(BALL, **SMALL).array, image.array)


def test_styles_cover_about_the_same():
    bare = {**SMALL, "transparent": True, "ground": False, "frame": 1.2 * np.vstack([np.eye(3), -np.eye(3)])}
    rays = cover(iso.render(BALL, **bare))
    for style in ("mesh", "flat", "wireframe"):
        assert cover(iso.render(BALL, style=style, n=500, **bare)) == pytest.approx(rays, rel=0.03)
    for style in ("discs", "points"):
        assert 0.3 * rays < cover(iso.render(BALL, style=style, n=500, **bare)) < 1.1 * rays
    assert cover(iso.render(BALL, opacity=0.5, **bare)) == pytest.approx(0.75 * rays, rel=0.02)


def test_planes_and_sections():
    pictures = [
        iso.render(BALL, planes=((0, 1, 0), 0.0), section=section, **SMALL).array
        for section in ("flat", "hatched", "distance", "slice")
    ]
    for k, a in enumerate(pictures):
        for b in pictures[:k]:
            assert not np.array_equal(a, b)
    with pytest.raises(ValueError, match="planes"):
        iso.render(BALL, planes=[(1, 2)], **SMALL)


def test_things_together():
    samples = iso.sample(BALL, n=200)
    alone, together = iso.render(BALL, **SMALL), iso.render([BALL, samples], **SMALL)
    assert not np.array_equal(alone.array, together.array)
    shown = iso.render([BALL, samples], values=iso.parse("x"), **SMALL)
    assert not np.array_equal(shown.array, together.array)
    mesh = iso.mesh(BALL, n=300)
    iso.render(mesh, style="wireframe", values=mesh.points[:, 2], **SMALL)
    iso.render(iso.Scene(BALL, n=100), coloring="normal", **SMALL)
    with pytest.raises(ValueError, match="expected fields"):
        iso.render([BALL, 3], **SMALL)


def test_nothing_and_functions_are_said():
    with pytest.warns(iso.EmptySurfaceWarning):
        iso.render(iso.parse("x^2 + y^2 + z^2 + 1"), bounds=1, **SMALL)
    ball = iso.from_function(lambda X: (X**2).sum(axis=1) - 1)
    with pytest.warns(UserWarning, match="intervals"):
        image = iso.render(ball, bounds=1.2, **SMALL)
    exact = iso.render(BALL, bounds=1.2, **SMALL)
    assert np.abs(image.array.astype(int) - exact.array).mean() < 2

    def fails(X):
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        iso.render(iso.from_function(fails), bounds=1, **SMALL)
    with pytest.raises(ValueError, match="bounds"):
        iso.render(iso.parse("z - sin(x)"), **SMALL)


def test_a_turntable_has_its_frames(tmp_path):
    from PIL import Image

    done = []
    iso.turntable(BALL, tmp_path / "turn.png", frames=3, progress=lambda k, n: done.append((k, n)), **SMALL)
    with Image.open(tmp_path / "turn.png") as turn:
        assert turn.n_frames == 3
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_the_command(tmp_path):
    run = CliRunner().invoke
    out = tmp_path / "a.png"
    small = ["--size", "64x48", "-o", str(out)]
    done = run(app, ["render", "x^2 + y^2 + z^2 - 1", "--cut", "x=0.2", "--section", "hatched", *small])
    assert done.exit_code == 0, done.output
    assert out.read_bytes()[1:4] == b"PNG"
    assert run(app, ["render", "x^2 + y^2 + z^2 + 1", "--bounds", "1", *small]).exit_code == 3
    assert run(app, ["render", "x^2 + y^2 + z^2 - 1", "--cut", "q", *small]).exit_code == 2
    assert run(app, ["render", "x^2 + y^2 + z^2 - 1", "--turntable", "2", *small]).exit_code == 0
    assert run(app, ["view", "x^2 + y^2 + z^2 - 1", "-n", "300", "--style", "wireframe", *small]).exit_code == 0


def test_planes_of_the_command():
    assert plane("x=0.2") == ((1.0, 0.0, 0.0), 0.2)
    assert plane("-z=0.5") == ((-0.0, -0.0, -1.0), -0.5)
    assert plane("1,2,3,4") == ((1.0, 2.0, 3.0), 4.0)


def test_progress_of_a_picture_grows_and_can_end_it():
    parts = []
    iso.render(iso.torus(major=1, minor=0.4), width=600, height=450, progress=parts.append)
    assert parts == sorted(parts)
    assert all(0 <= p <= 1 for p in parts)

    def stop(part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        iso.render(iso.torus(major=1, minor=0.4), width=2400, height=1800, progress=stop)
