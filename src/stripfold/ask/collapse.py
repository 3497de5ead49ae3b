"""A strip through its collapse: statics to the critical point, the fall to rest, statics again."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Self

from stripfold.ask.inputs import Simulation
from stripfold.base.arguments import checked, file_name
from stripfold.files.reporting import Progress, Result, Rows, metres

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class StripCollapse(Result):
    """A strip through its collapse: statics to lambda_c, the fall, statics again.

    Source: docs/physics.md, section 6.

    Attributes
    ----------
    dataset
        All states over ``state`` and ``node``, with their ``phase``, energies and contacts.
    simulation
        The inputs.
    """

    dataset: xr.Dataset
    simulation: Simulation
    title = "a strip through its collapse"
    shown = ("lambda_c", "touch", "rest_time")

    @classmethod
    def of(cls, simulation: Simulation, progress: Progress | None = None) -> Self:
        """Simulate it."""
        from stripfold.ask import collapse_record

        return cls(collapse_record.run(simulation, progress), simulation)

    @property
    def lambda_c(self) -> float:
        """Advance of the gripper past the flat end at the snap, m."""
        return float(self.dataset["lambda_c"])

    @property
    def touch(self) -> tuple[float, float]:
        """Time of the first touch after the release, s, and its x, m; nan where there is none."""
        return float(self.dataset["touch_time"]), float(self.dataset["touch_x"])

    @property
    def rest_time(self) -> float:
        """Time from the release to rest, s; nan where the fall was not followed so far."""
        return float(self.dataset["settle_time"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Effects that the scene needs and that were switched off."""
        missing = filter(None, self.dataset.attrs["missing"].split(", "))
        reasons = self.dataset["reason"]
        in_si = self.simulation.material.in_si
        return tuple(f"{name} is off and needed: {in_si(reasons.sel(effect=name).item())}" for name in missing)

    def rows(self) -> Rows:
        time, x = self.touch
        active = self.dataset["effect"].values[self.dataset["active"].values == 1.0]
        return [
            ("lambda_c", metres(self.lambda_c, "advance of the gripper past the flat end at the snap")),
            ("touch", f"after {time:.4g} s at x = {x:.4g} m" if isfinite(time) else "-"),
            ("rest", f"after {self.rest_time:.4g} s" if isfinite(self.rest_time) else "-"),
            ("effects", ", ".join(map(str, active))),
            ("end", self.dataset.attrs["end"]),
        ]

    def to_dict(self) -> dict[str, Any]:
        time, x = self.touch
        return {"lambda_c": self.lambda_c, "touch_time": time, "touch_x": x, "rest_time": self.rest_time}

    def to_dataset(self) -> xr.Dataset:
        return self.dataset

    def plot(self) -> Figure:
        """lambda over the deflection, through the collapse."""
        from stripfold.draw import collapse_curve

        return collapse_curve.draw(self.dataset)

    @checked
    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film."""
        from stripfold.base.extras import require

        require("vision")
        from stripfold.draw.film import film

        film(self.dataset, file_name("file", file), progress=progress)

    def config(self) -> dict[str, Any]:
        return self.simulation.as_config()
