from bellcrank.parts.part import *  # noqa: F403
