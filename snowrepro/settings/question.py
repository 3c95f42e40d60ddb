"""What is asked of runs: what a lump is, which claims are decided, which report is written."""

from typing import Any, Literal

from pydantic import Field, model_validator

from .analysis import Analysis
from .base import Name, Settings
from .design import Design

# Columns of a fallen run's summary that something can be claimed of: parts of a whole, from 0 to 1, and others.
Fraction = Literal[
    "lump_fraction", "crushed_fraction", "loose_fraction", "powder_fraction", "vanished", "largest_fragment",
    "median_mass", "broken_bonds", "lumps_by_strain", "lumps_by_bonds", "lumps_by_proximity", "lumps_by_grid",
    "lumps_by_damage", "largest_seen",
]  # fmt: skip
Measure = Literal[
    Fraction, "lumps", "fragments", "joined_chance", "effective_number", "second_moment", "impact_speed",
    "flattening_most", "flattening_end", "rebound", "density_at_release", "young_at_release", "hardening_at_release",
    "factor_at_release",
]  # fmt: skip


class Claim(Settings):
    """One claim of the paper, and how it is decided; conf/claims says what the tests are."""

    name: Name
    statement: str
    paper: str = Field(description="the paper's sentence")
    measure: Measure = Field(description="a column of the runs' summary")
    of: Literal["sintered", "unsintered", "contrast"] = "sintered"
    at: Literal["every", "lowest", "highest"] = "every"
    test: Literal["rises", "below", "above", "scenes"]
    threshold: float = Field(description="of the measure, of each of its steps, or of the share of a shape's scenes")
    claims: tuple[str, ...] = Field((), description="scenes: the claims that are counted")


class Claims(Settings):
    """What is to be decided, written before the runs that decide it."""

    name: Name
    alpha: float = Field(gt=0, lt=0.5, description="chance that a verdict on one scene is wrong, at most [1]")
    list: tuple[Claim, ...]

    @model_validator(mode="after")
    def _names_are_known(self) -> "Claims":
        names = [claim.name for claim in self.list]
        counted = [name for claim in self.list for name in claim.claims]
        unknown = sorted(set(counted) - {claim.name for claim in self.list if claim.test != "scenes"})
        if len(set(names)) < len(names):
            raise ValueError(f"two claims have the same name: {', '.join(names)}")
        if unknown:
            raise ValueError(f"there are no claims {', '.join(unknown)} to count over scenes")
        return self


HOW_USED = {"variants", "order", "varies", "checks"}  # settings of an experiment that say nothing of what it shows


class Experiment(Settings):
    """A figure, a table or a study: what its report draws from its runs, and where else it is used."""

    name: Name = Field(description="of the report's folder")
    title: str
    figure: str = Field("", description="of the paper, such as Fig. 5 or Table 2")
    says: str = Field("", description="what the paper says of it")
    picture: str = Field(description="the module of snowrepro/report/figures that draws it")
    frames: tuple[int, ...] = Field((), description="strip: the columns; setting: pressed and falling [frames]")
    calibrated_on: tuple[str, str] | None = Field(
        None, description="shape and floor whose sintered runs the pressures were chosen by"
    )
    targets: tuple[float, ...] = Field((), description="calibration: lump fractions to reach [1]")
    variants: dict[str, dict[str, Any]] = Field(
        {}, description="pieces of configuration by name, options of the group 'variant'; the first is the base"
    )
    order: float | None = Field(None, description="place in the report on the paper; none: not part of it")
    varies: str = Field("", description="the experiment of which this one makes one choice otherwise at a time")
    checks: tuple[Literal["coarse", "fine", "mutants"], ...] = Field(
        (), description="uses of its runs in 'snowrepro check': coarsely, as fine as the paper, to try mutants on"
    )


class Question(Settings):
    """All that is asked of a run."""

    analysis: Analysis
    claims: Claims
    experiment: Experiment | None = None
    design: Design | None = None
    reports: str = Field(min_length=1, description="folder that reports are written to")
