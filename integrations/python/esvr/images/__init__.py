"""Images of microscopes, scanners and simulations as grids.

image.py has the model of an image (axes, units, orientation, missing values) and reads plain arrays of numbers, the modules
read_*.py have the readers of the formats, writers.py has the writers, and image2vdb.py, vdb2image.py and program.py are the
programs.
"""
