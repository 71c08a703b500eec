"""The command line: parse, call, render. No physics here."""

from bellcrank.cli.app import main

__all__ = ["main"]
