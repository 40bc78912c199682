"""Prints the peak resident memory of one sample() of 16 blobs: run as a programme of its own."""

import json
import resource
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "python")]

if __name__ == "__main__":
    import isoswarm as iso

    from peers import fields
    from rows import surfaces

    field, bounds = surfaces.field(fields.sixteen_blobs())
    samples = iso.sample(field, n=int(sys.argv[1]), bounds=bounds)
    unit = 1 if sys.platform == "darwin" else 1024
    print(json.dumps({"bytes": unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, "n": len(samples)}))
