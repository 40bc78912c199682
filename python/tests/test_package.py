"""The package as installed."""

import importlib.metadata

import isoswarm as iso


def test_version_is_the_workspace_version() -> None:
    assert iso.__version__ == importlib.metadata.version("isoswarm")
