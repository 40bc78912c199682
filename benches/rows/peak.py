"""Prints the peak resident memory of one sample() of 16 blobs: run as a programme of its own."""

import json
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "python")]

if __name__ == "__main__":
    import isoswarm as iso

    from peers import fields
    from rows import surfaces

    field, bounds = surfaces.field(fields.sixteen_blobs())
    samples = iso.sample(field, n=int(sys.argv[1]), bounds=bounds)
    # The high-water mark of this programme alone: ru_maxrss would start from that of the programme that called it.
    status = Path("/proc/self/status").read_text()
    kilobytes = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    print(json.dumps({"bytes": 1024 * kilobytes, "n": len(samples)}))
