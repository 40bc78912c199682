"""``python -m isoswarm``."""

from isoswarm.cli import main

if __name__ == "__main__":
    main()
