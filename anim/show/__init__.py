"""Plots and filmstrips as bytes of image files."""
