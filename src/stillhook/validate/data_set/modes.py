"""The PLC's mode in a log: its own numbers or words and their meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import ValidateError
from stillhook.logs.types import Signal
from stillhook.spec.scenario import Mode
from stillhook.units import number

STANDARD_MODES: Mapping[float, Mode] = {float(i): mode for i, mode in enumerate(Mode)}
"""The numbers of `stillhook.variables`."""
WORDS_FROM = 1e6
"""Numbers from here on represent words of the log: no PLC uses mode numbers this high."""
LEAST = 0.3
"""A mode of shorter duration is the mean of two codes in one bin, or a logging artefact [s]: the previous mode
continues."""


def with_modes(
    mapping: Mapping[str, Signal] | None, modes: Mapping[str, Mode]
) -> tuple[Mapping[str, Signal] | None, Mapping[float, Mode]]:
    """A mapping whose mode may be written in words, and the meaning of each number."""
    if not modes:
        return mapping, STANDARD_MODES
    numbers = {key: _number(key) for key in modes}
    words = {key: WORDS_FROM + i for i, key in enumerate(k for k, value in numbers.items() if value is None)}
    meaning = {(words[key] if value is None else value): modes[key] for key, value in numbers.items()}
    if mapping is None or "mode" not in mapping:
        return mapping, meaning
    signal = replace(mapping["mode"], words=(*mapping["mode"].words, *words.items()))
    return {**mapping, "mode": signal}, meaning


def _number(key: str) -> float | None:
    try:
        return float(key)
    except ValueError:
        return None


def standard_modes(values: FloatArray, step: float, meaning: Mapping[float, Mode], place: str) -> FloatArray:
    """The modes of a log by the numbers of `stillhook.variables`, NaN where the log has none.

    Parameters: values (n,) every `step` [s]; meaning of each number; place is the prefix of a message.
    Errors: ValidateError for a number without a meaning.
    """
    code = np.full(len(values), np.nan)
    for value, mode in meaning.items():
        code[np.abs(values - value) < 1e-6] = float(list(Mode).index(mode))
    edges = np.flatnonzero(~((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1])))) + 1
    for a, b in zip([0, *edges], [*edges, len(values)], strict=True):
        if np.isnan(values[a]) or (not np.isnan(code[a]) and (b - a) * step >= LEAST):
            continue
        if (b - a) * step >= LEAST:
            known = ", ".join(_mode_text(value) for value in meaning)
            raise ValidateError(
                f"{place}mode: the log holds {number(float(values[a]), 6)} for {(b - a) * step:.3g} s, which is not one"
                f' of {known}. State its meaning in the campaign file: [modes], such as "5" = "ssc".'
            )
        code[a:b] = code[a - 1] if a else np.nan
    first = np.flatnonzero(np.isfinite(code))
    if len(first) and first[0] * step < LEAST:
        code[: first[0]] = code[first[0]]
    return code


def _mode_text(value: float) -> str:
    return "a word" if value >= WORDS_FROM else number(value, 6)
