"""Actuators as others meet them, and machines made of them."""
