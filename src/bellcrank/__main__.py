"""``python -m bellcrank`` is the same as ``bellcrank``."""

from bellcrank.cli import main

if __name__ == "__main__":
    main()
