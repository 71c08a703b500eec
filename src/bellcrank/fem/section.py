from bellcrank.parts.section import *  # noqa: F403
