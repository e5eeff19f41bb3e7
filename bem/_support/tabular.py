"""Units of quantities, and records that show themselves: in a line, a notebook, a table of pandas, a set of xarray."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from io import StringIO
from typing import TYPE_CHECKING, Any, NamedTuple

from bem._support.validation import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

TIME, LENGTH, FORCE = "retardation time", "h0", "pi R dgamma"
UNITS = {
    "tabor": "",
    **dict.fromkeys(("time", "dwell_time", "pull_off_time"), TIME),
    **dict.fromkeys(("indentation", "stage", "peak_indentation"), LENGTH),
    **dict.fromkeys(("loading_rate", "unloading_rate"), f"{LENGTH} / {TIME}"),
    **dict.fromkeys(("force", "force_before", "force_after", "pull_off_force", "max_compression", "end_force"), FORCE),
    "hysteresis": f"{LENGTH} {FORCE}",
    "contact_radius": "beta",
    "solver_seconds": "s",
}
"""The unit of each quantity; "" is a pure number."""
_SYMBOLS = {"h0 ": "<i>h</i><sub>0</sub> ", "pi R dgamma": "π<i>R</i>Δγ"}  # of units, in HTML
INSTALL = "install it with `pip install '.[tables]'` in a clone of the repository"


class Column(NamedTuple):
    """Values of one quantity, of shape (n,), with its unit as text; "" is a pure number."""

    values: FloatArray
    unit: str


def labelled(variables: dict[str, Any], attributes: dict[str, Any], **coordinates: Any) -> xr.Dataset:
    """An `xarray.Dataset` of variables, each with its dimensions, values and unit.

    Raises:
        ImportError: xarray is not installed.
    """
    try:
        import xarray as xr
    except ImportError as error:
        raise ImportError(f"a labelled data set needs xarray; {INSTALL}") from error
    parts = (
        {name: (along, values, {"units": unit}) for name, (along, values, unit) in group.items()}
        for group in (variables, coordinates)
    )
    return xr.Dataset(*parts, attrs=attributes)


class Tabular(ABC):
    """Base of records in columns of equal length.

    A subclass gives `columns`, `facts`, `summary` and `plot`.
    """

    @abstractmethod
    def columns(self) -> dict[str, Column]:
        """The columns by name."""

    @abstractmethod
    def facts(self) -> dict[str, str]:
        """What identifies the record at a glance, as texts by name."""

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """What describes the whole record."""

    def attributes(self) -> dict[str, Any]:
        """Numbers and texts of the summary, with 0 and 1 for truth values, which the files of xarray do not know."""
        scalars = {name: value for name, value in self.summary().items() if isinstance(value, str | float | bool)}
        return {name: int(value) if isinstance(value, bool) else value for name, value in scalars.items()}

    @abstractmethod
    def plot(self) -> Figure:
        """Draw the record into a new figure."""

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {value}" for name, value in self.facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
            for name, value in self.facts().items()
        )
        for plain, symbols in _SYMBOLS.items():
            rows = rows.replace(plain, symbols)
        text = f"<b>{type(self).__name__}</b><table>{rows}</table>"
        if any(len(column.values) for column in self.columns().values()):
            drawn = StringIO()
            self.plot().savefig(drawn, format="svg")
            picture = drawn.getvalue()
            text += picture[picture.index("<svg") :]
        return text

    def to_dataframe(self) -> pd.DataFrame:
        """The columns as a `pandas.DataFrame`; `attrs` holds the scalars and, under "units", the unit of each column.

        Raises:
            ImportError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError(f"a data frame needs pandas; {INSTALL}") from error
        table = pd.DataFrame({name: column.values for name, column in self.columns().items()})
        table.attrs = self.attributes() | {"units": {name: column.unit for name, column in self.columns().items()}}
        return table

    def to_xarray(self) -> xr.Dataset:
        """The columns as an `xarray.Dataset` along `record`.

        Each has the attribute `units`; the scalars are attributes of the whole.
        Time is a coordinate, not the index: at a jump two records share one time.

        Raises:
            ImportError: xarray is not installed.
        """
        variables = {name: ("record", *column) for name, column in self.columns().items()}
        time = variables.pop("time")
        return labelled(variables, self.attributes(), time=time)
