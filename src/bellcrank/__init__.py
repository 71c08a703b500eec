"""bellcrank designs mechanical metamaterial actuators."""

__version__ = "0.1.0"
