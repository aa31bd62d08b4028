"""Images of microscopes, scanners and simulations as grids, and grids as images: the programs image2vdb and vdb2image.

image.py has the model of an image (axes, units, orientation, missing values), read_*.py have the readers of the formats,
write.py has the writers, and image2vdb.py and vdb2image.py are the programs. docs/images.md has the conventions.
"""
