"""Readers of scan files, one module for each family of formats.

A reader takes a path and returns a :class:`ScanFile`: the channels of the file, in the units of the file.
:mod:`roughvisc.topography.readers` decides units, missing values and orientation, and refuses implausible files.
"""

from roughvisc.topography.formats.registry import Channel, ScanFile, add_format

__all__ = ["Channel", "ScanFile", "add_format"]
