"""Arrays in an NPZ file, read only where its headers and its size agree.

A header of some bytes can claim any shape, and a member of an archive any size: what is claimed is compared with what
the file can hold before memory is taken for it.
"""

from __future__ import annotations

import io
import math
import sys
import zipfile
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from stillhook.base.gateway.budget import most_unpacked

PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""How numpy packs; other methods unpack a block of any size at once."""


def read_arrays(content: bytes) -> dict[str, NDArray[Any]]:
    """Every array of an NPZ file by name, none of them of objects. Errors: ValueError, zipfile.BadZipFile and others of
    what reads archives, for a file that numpy did not write, or that is larger than it can be."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if sum(each.file_size for each in members) > most_unpacked(len(content)):
            raise ValueError("claims to hold more than it can")
        return dict(_arrays(archive, members))


def _arrays(archive: zipfile.ZipFile, members: list[zipfile.ZipInfo]) -> Iterator[tuple[str, NDArray[Any]]]:
    for member in members:
        if member.compress_type not in PACKED:
            raise ValueError("packed as numpy does not pack")
        with archive.open(member) as stream:
            if npy.read_magic(stream) != (1, 0):
                raise ValueError("an unknown version of arrays")
            shape, _, dtype = npy.read_array_header_1_0(stream)
            if (
                dtype.names is not None
                or not dtype.itemsize
                or math.prod(shape) * dtype.itemsize != member.file_size - stream.tell()
            ):
                raise ValueError("its header does not fit its size")
        with archive.open(member) as stream:
            array = npy.read_array(stream, allow_pickle=False)
        if dtype.kind == "U" and not _is_text(array):
            raise ValueError("holds numbers that are not code points of a text")
        yield member.filename.removesuffix(".npy"), array


def _is_text(array: NDArray[Any]) -> bool:
    """Whether every sign of an array of texts is one of Unicode: numpy takes any number, and Python fails at it."""
    codes = array.reshape(-1).view(np.dtype("u4").newbyteorder(array.dtype.byteorder))
    return not np.any((codes > sys.maxunicode) | ((codes >= 0xD800) & (codes <= 0xDFFF)))


def packed(arrays: Mapping[str, Any]) -> bytes:
    """The NPZ file of arrays by name, which `read_arrays` reads."""
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()
