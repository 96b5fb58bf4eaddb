"""`run.stillhook` on every Dataset: its summary, its series, its figure. Registered when xarray is first loaded, so
that it imports nothing else before it is used."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import xarray

from stillhook.errors import StillhookError

if TYPE_CHECKING:
    from stillhook.plot.summary import Summary

FIGURES = "run, lowering, map, envelope, settings, uncertainty"
NAMES = ("plot", "series", "summary")


@xarray.register_dataset_accessor("stillhook")  # type: ignore[no-untyped-call]
class Accessor:
    """A Dataset of Stillhook: its summary, its series, its figure."""

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    def __dir__(self) -> list[str]:
        return list(NAMES)

    @property
    def summary(self) -> Summary:
        """The numbers of a run that have no time, by name, with units."""
        from stillhook.plot.summary import Summary

        return Summary(self._data)

    @property
    def series(self) -> xarray.Dataset:
        """What is stored over time, alone."""
        return self._data[[name for name, x in self._data.data_vars.items() if "time" in x.dims]]

    def plot(self, **options: Any) -> Any:
        """The figure of what this is: a run, a lowering, a map, an envelope, settings or uncertainty.

        Parameters
        ----------
        **options
            Those of the function in `stillhook.plot` with this name.

        Returns
        -------
        Figure
            Of matplotlib.

        Raises
        ------
        StillhookError
            One line, for a Dataset that has no figure.
        """
        from stillhook import plot

        return getattr(plot, self._figure)(self._data, **options)

    @property
    def _figure(self) -> str:
        """Name of the function in `stillhook.plot`. Errors: StillhookError."""
        data = self._data
        tests = {
            "run": "scenarios" in data.attrs,
            "lowering": "lowerings" in data.attrs,
            "map": {"cause", "applicable"} <= set(data.data_vars),
            "envelope": "v_w_top" in data,
            "settings": "alpha_m_ideal" in data,
            "uncertainty": "at_values" in data.attrs,
        }
        name = next((name for name, holds in tests.items() if holds), None)
        if name is None:
            raise StillhookError(
                f"plot: no figure of this Dataset. There are those of {FIGURES}; others by stillhook.plot."
            )
        return name

    def __repr__(self) -> str:
        return repr(self.summary)

    def _repr_html_(self) -> str:
        """Title, summary, and the Dataset below."""
        title = escape(str(self._data.attrs.get("title", "Stillhook")))
        return f"<div><b>{title}</b>{self.summary._repr_html_()}{self._data._repr_html_()}</div>"
