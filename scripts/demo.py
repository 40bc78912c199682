"""The main job on real input: the surface of a protein, evenly sampled. Called by `make demo`."""

import subprocess
import sys
from pathlib import Path

MODEL = "models/1tii.pdb"
OUTPUT = Path("build/demo")
COUNT = 100_000
NOT_CONVERGED = 4  # the files are there all the same, and the report says why


def main() -> int:
    """Sample, report, and draw; returns the command's exit code."""
    points, picture = OUTPUT / "1tii.ply", OUTPUT / "1tii.png"
    command = ["isoswarm", "sample", MODEL, "-n", str(COUNT), "-o", str(points), "--picture", str(picture)]
    print(f"{COUNT:,} samples on the surface of a bacterial toxin, without its water:\n\n$ {' '.join(command)}\n")
    code = subprocess.run(command, check=False).returncode
    if code in (0, NOT_CONVERGED):
        print(f"\nOpen {points} in MeshLab, Blender or Python; look at {picture}.")
        return 0
    return code


if __name__ == "__main__":
    sys.exit(main())
