"""Which changes an input of a form gets."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

from fuzz.mutators.dataset import by_netcdf
from fuzz.mutators.repair import Mutator, by_gzip, by_npz, by_packet, by_sealed, by_state, by_zip
from fuzz.mutators.tokens import by_bytes, by_lines, by_tokens
from fuzz.mutators.values import by_json, by_toml
from fuzz.targets.registry import Form

OF_FORM: Mapping[Form, Sequence[Mutator]] = {
    Form.WORDS: (by_tokens,) * 6 + (by_bytes,),
    Form.TOML: (by_toml,) * 5 + (by_tokens,) * 3 + (by_lines, by_bytes),
    Form.JSON: (by_json,) * 6 + (by_tokens,) * 2 + (by_bytes,),
    Form.SEALED: (by_sealed,) * 8 + (by_json, by_bytes),
    Form.STATE: (by_state,) * 6 + (by_bytes,),
    Form.TABLE: (by_tokens,) * 5 + (by_lines,) * 4 + (by_bytes,) * 2,
    Form.GZIP: (by_gzip,) * 4 + (by_bytes,),
    Form.ZIP: (by_zip,) * 4 + (by_bytes,),
    Form.NPZ: (by_npz,) * 6 + (by_zip,) * 2 + (by_bytes,),
    Form.NETCDF: (by_netcdf,) * 4 + (by_bytes,),
    Form.PACKET: (by_packet,) * 2 + (by_bytes,) * 2,
    Form.BINARY: (by_bytes,),
}
STACKED = (1, 1, 1, 2, 2, 3, 5)
"""Changes of one input."""


def mutated(r: random.Random, form: Form, data: bytes, others: Sequence[bytes]) -> bytes:
    """An input with some changes that suit its form, or of its bytes where it is not of that form any more."""
    for _ in range(r.choice(STACKED)):
        change = r.choice(OF_FORM[form])
        try:
            data = change(r, data, others)
        except Exception:  # a damaged input is parsed, by libraries that raise anything
            data = by_bytes(r, data, others)
    return data
