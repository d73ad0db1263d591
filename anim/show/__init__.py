"""Plots and filmstrips as bytes of image files, pages as HTML."""
