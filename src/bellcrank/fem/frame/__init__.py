"""Frames: struts as beam elements with rigid joints."""
