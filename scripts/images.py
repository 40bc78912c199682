"""Makes the pictures in docs/images anew: `.venv/bin/python scripts/images.py`."""

import io
from pathlib import Path

from PIL import Image

import isoswarm as iso

IMAGES = Path(__file__).parent.parent / "docs" / "images"


def save(png: bytes, name: str) -> None:
    """Write a picture with a palette of 256 colours, which is a third of the size."""
    with Image.open(io.BytesIO(png)) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.FLOYDSTEINBERG).save(IMAGES / name, optimize=True)


def main() -> None:
    """Draw the README's protein."""
    protein = iso.sample(iso.molecule(IMAGES.parents[1] / "models" / "1tii.pdb"), n=100_000)
    save(protein.picture(width=1000, height=720, supersampling=4), "protein.png")


if __name__ == "__main__":
    main()
