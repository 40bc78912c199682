"""What several tests share."""

from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.fixture(scope="session")
def sphere() -> iso.Samples:
    """500 samples of the unit sphere."""
    return iso.sample(iso.sphere(r=1.0), n=500, bounds=1.5)
