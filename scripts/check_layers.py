"""Checks that the crates import in one direction only, as ARCHITECTURE.md says."""

import json
import subprocess
import sys

# Each crate and the crates of this workspace that it may use: all those before it in the flow of data.
ALLOWED: dict[str, set[str]] = {
    "isoswarm-field": set(),
    "isoswarm-particles": {"isoswarm-field"},
    "isoswarm-geometry": {"isoswarm-field", "isoswarm-particles"},
    "isoswarm-scene": {"isoswarm-field", "isoswarm-particles", "isoswarm-geometry"},
    "isoswarm": {"isoswarm-field", "isoswarm-particles", "isoswarm-geometry", "isoswarm-scene"},
    "isoswarm-python": {
        "isoswarm-field",
        "isoswarm-particles",
        "isoswarm-geometry",
        "isoswarm-scene",
        "isoswarm",
    },
}


def violations(packages: list[dict[str, object]], allowed: dict[str, set[str]]) -> list[str]:
    """The imports that go against the flow, one sentence each.

    Parameters
    ----------
    packages : list of dict
        What ``cargo metadata --no-deps`` calls packages.
    allowed : dict
        Crate to the crates that it may use.

    """
    found = []
    own = {str(package["name"]) for package in packages}
    for name in sorted(own - allowed.keys()):
        found.append(f"{name} is not in scripts/check_layers.py: say there which crates it may use")
    for package in packages:
        name = str(package["name"])
        dependencies = package["dependencies"]
        assert isinstance(dependencies, list)
        for dependency in dependencies:
            used = dependency["name"]  # itself: a crate's tests with its own features
            if used in own - {name} and used not in allowed.get(name, own):
                found.append(f"{name} must not use {used}: see ARCHITECTURE.md, layers")
    return found


def main() -> int:
    """Print the violations; 1 if there are any."""
    text = subprocess.run(
        ["cargo", "metadata", "--no-deps", "--format-version", "1", "--locked"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    found = violations(json.loads(text)["packages"], ALLOWED)
    for line in found:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
