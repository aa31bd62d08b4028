"""Images of microscopes, scanners and simulations as grids.

image.py has the model of an image (axes, units, orientation, missing values), flat.py reads plain arrays of numbers, the
modules read_*.py have the readers of the formats, and image2vdb.py and program.py are the program.
"""
