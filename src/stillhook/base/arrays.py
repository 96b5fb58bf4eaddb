"""Types of the arrays that all rooms share, and columns of numbers as text, exact to the bit."""

from __future__ import annotations

import base64
import zlib

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


def encode_array(column: NDArray[np.float64]) -> str:
    """A column as text."""
    return base64.b64encode(zlib.compress(column.astype("<f8").tobytes())).decode("ascii")


def decode_array(text: str) -> NDArray[np.float64]:
    """The column that `encode_array` wrote.

    Errors: TypeError, ValueError (binascii.Error), zlib.error where the text is not one.
    """
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<f8")
