"""Readers of scan files.

A reader takes a path and returns a :class:`ScanFile`: the channels of the file, in the units of the file.
:mod:`roughvisc.topography.readers` decides units, missing values and orientation, and refuses implausible files.
"""

from roughvisc.topography.formats.registry import add_format
from roughvisc.topography.formats.scan_file import Channel, ScanFile

__all__ = ["Channel", "ScanFile", "add_format"]
