"""The command line: parse, call, render. No physics here."""

from bellcrank.cli.main import main

__all__ = ["main"]
