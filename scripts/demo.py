"""The main job on real input: the surface of a protein, evenly sampled. Called by `make demo`."""

import subprocess
import sys
from pathlib import Path

MODEL = "models/1tii.pdb"
OUTPUT = Path("build/demo")
COUNT = 100_000


def main() -> int:
    """Sample, report, and draw; returns the first exit code that is not 0."""
    points, picture = OUTPUT / "1tii.ply", OUTPUT / "1tii.png"
    print(f"{COUNT:,} samples on the surface of {MODEL}, a bacterial toxin, without its water:\n")
    for arguments in (
        ["sample", MODEL, "-n", str(COUNT), "-o", str(points)],
        ["view", MODEL, "-n", str(COUNT), "-o", str(picture), "--style", "surface"],
    ):
        code = subprocess.run(["isoswarm", *arguments], check=False).returncode
        if code:
            return code
    print(f"\nOpen {points} in MeshLab, Blender or Python; look at {picture}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
