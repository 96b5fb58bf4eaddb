"""Results as JSON that can be stored and compared: normalised, condensed, written, and compared leaf by leaf."""

import functools
import hashlib
import json
import math
import os
import re
import struct
import zlib
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray

from stillhook.base.arrays import decode_array

EXPECTED = Path(__file__).with_name("expected")
MACHINE = "machine"
"""Name of the file that holds the machine's fingerprint."""
RELATIVE_TOLERANCE = 1e-6
"""Between machines: other CPUs and libraries round differently (fused multiply-add, vector width, order of sums). Integration and root
finding amplify that from 1e-16 to some 1e-9; a change of the model is far above 1e-6."""
SEARCHED, SEARCH_TOLERANCE = re.compile(r"\bmodels\.columns\.parameters\.[abp]_\dD?\."), 1e-3
"""Between machines: parameters of the two-line loss models, whose search ends where the sum of squares changes by less than 1e-6 of itself.
About its minimum that sum is quadratic, so the parameters themselves are found to some sqrt(1e-6)."""
ABSOLUTE_TOLERANCE = 1e-12
"""Between machines: rounding errors of quantities that are zero, such as a speed at rest [SI]."""
DROPPED = frozenset(
    {"wall", "date", "version", "code", "elapsed", "seconds", "created", "platform", "python", "same_pdf"}
)
"""Keys that say when, where and with which code a result was made."""
HASHED = "sha256"
"""Key of a hash of the values: compared on the same machine only."""
LONGEST_LIST = 16
LONGEST_TABLE = 6
LONGEST_TEXT = 160
SAMPLES = 8
COLUMN_SAMPLES = 4
MOST_COUNTED = 12
ABSENT = "(absent)"
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
FOLDER = re.compile(r"[^\s\"']*/frozen-\w+(?:-\w+)*")
"""A temporary folder of a case."""
NUMBER_OF_PLAN = re.compile(r"No\. (?:[0-9a-f]{4} ?){3}")
"""The digest of a plan as its pages show it."""
HEX = re.compile(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{16,}\b")


class Difference(NamedTuple):
    """A leaf that differs: its path within the JSON, the stored and the new value."""

    path: str
    old: object
    new: object

    def __str__(self) -> str:
        return f"{self.path}: {shown(self.old)} -> {shown(self.new)}"


def shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 160 else text[:157] + "..."


# Normalise and condense


def dataset(data: xarray.Dataset) -> dict[str, Any]:
    """Variables of a result. Signals without a value other than 0 are left out: winches without a circuit may or may not have them."""
    out: dict[str, Any] = {}
    for name in sorted(map(str, data.variables)):
        values = data[name].values
        if values.ndim and values.dtype.kind in "fiub" and not np.any(np.nan_to_num(values.astype(float))):
            continue
        out[name] = (
            [str(v) for v in values.ravel()] if values.ndim and values.dtype.kind not in "fiub" else values.tolist()
        )
        if not values.ndim and values.dtype.kind not in "fiub":
            out[name] = str(values)
    return out


def normalised(value: object, replaced: Mapping[str, str]) -> Any:
    """Without run times, dates, versions and hashes; `replaced`: texts such as absolute paths and what stands for them."""
    match value:
        case dict():
            return {str(k): normalised(v, replaced) for k, v in value.items() if k not in DROPPED}
        case list() | tuple():
            return [normalised(v, replaced) for v in value]
        case str():
            for old, new in replaced.items():
                value = value.replace(old, new)
            return HEX.sub("<hash>", NUMBER_OF_PLAN.sub("No. <hash>", FOLDER.sub("<folder>", value)))
        case bool() | int() | None:
            return value
        case float():
            return value if math.isfinite(value) else str(value)
    raise TypeError(f"{type(value).__name__} is no JSON: {value!r}")


def condensed(value: Any) -> Any:
    """Long lists as shape, extremes, a few samples and a hash; long tables by columns; long texts as their beginning and a hash."""
    match value:
        case dict():
            return {k: condensed(v) for k, v in value.items()}
        case str() if len(value) > LONGEST_TEXT:
            numbers = numbers_in(value)
            if numbers is not None:
                return condensed_array(numbers, (len(numbers),))
            return {"length": len(value), "begins": value[:60], HASHED: digest(value.encode())}
        case list():
            return condensed_list(value)
    return value


def numbers_in(text: str) -> list[Any] | None:
    """Numbers of a column that is written as text; None for any other text."""
    try:
        return [None if math.isnan(x) else x for x in decode_array(text).tolist()]
    except (ValueError, zlib.error):
        return None


def condensed_list(values: list[Any]) -> Any:
    shape = shape_of(values)
    if shape is not None and math.prod(shape) > LONGEST_LIST:
        return condensed_array(flat(values), shape)
    if len(values) > LONGEST_TABLE and all(isinstance(v, dict) for v in values):
        rows = [dict(flat_fields(v)) for v in values]
        names = sorted({name for row in rows for name in row})
        columns = {name: condensed_column([row.get(name, ABSENT) for row in rows]) for name in names}
        return {"rows": len(rows), "columns": columns}
    if len(values) > LONGEST_LIST and all(v is None or isinstance(v, str | bool) for v in values):
        return condensed_texts(values)
    return [condensed(v) for v in values]


def condensed_column(values: list[Any]) -> Any:
    if all(v == values[0] and type(v) is type(values[0]) for v in values):
        return {"all": condensed(values[0]), "length": len(values)}
    plain = [None if v == ABSENT else v for v in values]
    if any(is_number(v) for v in plain) and all(v is None or is_number(v) for v in plain):
        return condensed_array(plain, (len(plain),), COLUMN_SAMPLES)
    if all(v is None or isinstance(v, str | bool) for v in values):
        return condensed_texts(values)
    if all(isinstance(v, list) and all(x is None or is_number(x) for x in v) for v in values):
        return {
            "lengths": condensed([len(v) for v in values]),
            "joined": condensed_list([x for v in values for x in v]),
        }
    return {"length": len(values), HASHED: digest(json.dumps(values).encode())}


def condensed_array(values: list[Any], shape: tuple[int, ...], samples: int = SAMPLES) -> dict[str, Any]:
    """None stands for a missing number."""
    numbers = [math.nan if v is None else float(v) for v in values]
    known = [x for x in numbers if not math.isnan(x)]
    out: dict[str, Any] = {"shape": " x ".join(map(str, shape))}
    if len(known) < len(numbers):
        out["known"] = len(known)
    if known:
        finite = [x for x in known if math.isfinite(x)]
        out |= {"min": min(known), "max": max(known), "mean": math.fsum(finite) / len(finite) if finite else math.nan}
    out["samples"] = sampled(numbers, samples)
    out[HASHED] = digest(struct.pack(f"<{len(numbers)}d", *numbers))
    return {k: text_of_odd(v) for k, v in out.items()}


def condensed_texts(values: list[Any]) -> dict[str, Any]:
    names = sorted({json.dumps(v, ensure_ascii=False) for v in values})
    out: dict[str, Any] = {
        "length": len(values),
        "samples": sampled(values, COLUMN_SAMPLES),
        HASHED: digest(json.dumps(values).encode()),
    }
    if len(names) <= MOST_COUNTED:
        out["counts"] = {name: sum(json.dumps(v, ensure_ascii=False) == name for v in values) for name in names}
    return condensed({k: v for k, v in out.items() if k != "counts"}) | {k: v for k, v in out.items() if k == "counts"}


def text_of_odd(value: Any) -> Any:
    """NaN and infinity as texts."""
    if isinstance(value, list):
        return [text_of_odd(v) for v in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def sampled(values: list[Any], count: int) -> list[Any]:
    if len(values) <= count:
        return list(values)
    return [values[round(i * (len(values) - 1) / (count - 1))] for i in range(count)]


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def shape_of(values: Any) -> tuple[int, ...] | None:
    """Shape of a rectangular nest of lists of numbers and None, at least one of them a number; else None."""
    if not isinstance(values, list) or not values:
        return None
    if all(v is None or is_number(v) for v in values):
        return (len(values),) if any(is_number(v) for v in values) else None
    shapes = {shape_of(v) for v in values}
    (first, *others) = shapes
    return None if others or first is None else (len(values), *first)


def flat(values: list[Any]) -> list[Any]:
    return [x for v in values for x in (flat(v) if isinstance(v, list) else [v])]


def flat_fields(row: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in row.items():
        if isinstance(value, dict):
            yield from flat_fields(value, f"{before}{key}.")
        else:
            yield before + key, value


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


# Files


def path_of(name: str) -> Path:
    return EXPECTED / f"{name}.json"


def stored(name: str) -> Any:
    return json.loads(path_of(name).read_text(encoding="utf-8"))


def stored_names() -> set[str]:
    return {path.stem for path in EXPECTED.glob("*.json")} - {MACHINE}


def text_of(value: object) -> str:
    return json.dumps(value, indent=1, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"


def store(name: str, value: object) -> None:
    EXPECTED.mkdir(exist_ok=True)
    path = path_of(name)
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(text_of(value), encoding="utf-8")
    temporary.replace(path)


def machine() -> dict[str, Any]:
    """What the last bits of results depend on."""
    import llvmlite
    import numba
    import numpy
    import scipy
    from llvmlite import binding

    features = binding.get_host_cpu_features().flatten()
    versions = {m.__name__: m.__version__ for m in (llvmlite, numba, numpy, scipy)}
    return {"cpu": binding.get_host_cpu_name(), "features_sha256": digest(features.encode()), "versions": versions}


@functools.cache
def same_machine() -> bool:
    """Whether bits may be asked for; without LLVM's binding nothing says which machine this is."""
    return path_of(MACHINE).exists() and find_spec("llvmlite") is not None and stored(MACHINE) == machine()


# Compare


def differences(old: Any, new: Any, *, exact: bool, path: str = "", scale: float = 0.0) -> Iterator[Difference]:
    """Leaves that differ. exact: to the bit; else numbers within the tolerances, `scale` being the largest magnitude of an array's values,
    numbers within texts likewise, and hashes not at all."""
    if isinstance(old, dict) and isinstance(new, dict):
        scale = 0.0 if exact else array_scale(old)
        for key in sorted(old.keys() | new.keys()):
            if exact or key != HASHED:
                yield from differences(
                    old.get(key, ABSENT),
                    new.get(key, ABSENT),
                    exact=exact,
                    path=f"{path}.{key}" if path else key,
                    scale=scale,
                )
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield Difference(f"{path}.length", len(old), len(new))
        for i, (a, b) in enumerate(zip(old, new, strict=False)):
            yield from differences(a, b, exact=exact, path=f"{path}[{i}]", scale=scale)
    elif not (identical(old, new) or (not exact and close(old, new, scale, tolerance_of(path)))):
        yield Difference(path, old, new)


def array_scale(value: dict[str, Any]) -> float:
    ends = [value.get("min"), value.get("max")] if "samples" in value else []
    return max((abs(x) for x in ends if is_number(x)), default=0.0)


def identical(old: Any, new: Any) -> bool:
    """1 and 1.0 are the same number, and so are 0.0 and -0.0; True and 1 are not."""
    return old == new and is_number(old) == is_number(new) and isinstance(old, bool) == isinstance(new, bool)


def tolerance_of(path: str) -> float:
    """Relative tolerance of the leaf at a path, between machines."""
    return SEARCH_TOLERANCE if SEARCHED.search(path) else RELATIVE_TOLERANCE


def close(old: Any, new: Any, scale: float = 0.0, tolerance: float = RELATIVE_TOLERANCE) -> bool:
    if is_number(old) and is_number(new):
        return math.isclose(old, new, rel_tol=tolerance, abs_tol=max(ABSOLUTE_TOLERANCE, tolerance * scale))
    if isinstance(old, str) and isinstance(new, str):
        a, b = NUMBER.findall(old), NUMBER.findall(new)
        same_words = NUMBER.sub("#", old) == NUMBER.sub("#", new)
        return same_words and all(close(float(x), float(y)) for x, y in zip(a, b, strict=True))
    return False
