from bellcrank.parts.materials import *  # noqa: F403
