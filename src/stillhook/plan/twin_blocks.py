"""Blocks of a result that only runs can tell: how landing speeds scatter, and how numbers settle with seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray


def blocks(work: Any) -> dict[str, xarray.Dataset]:
    return {}
