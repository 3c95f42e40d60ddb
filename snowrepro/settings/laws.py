"""The laws that a case can choose, and their parameters: what a material is, and what pressing does to it.

Stresses have the unit of ``material.E``.  Where a description names no source, the value is free.
"""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from .base import Name, Settings


class InstalledLaw(Settings):
    """Somebody else's, of an installed package: see ``own_law``.  All but its parameters is found, not chosen."""

    name: Name = Field(description="of the law's entry point")
    package: str = Field(min_length=1, max_length=200, description="that has the law")
    version: str = Field(max_length=200, description="of the package")
    digest: str = Field(pattern=r"^[0-9a-f]{16}$", description="of the package's source")
    parameters: dict[str, bool | int | float | str] = Field({}, description="as the law declares them")

    @property
    def origin(self) -> str:
        """Package and version."""
        return f"{self.package} {self.version}".strip()


def _tag_law(law: Any) -> str:
    """The name of a law of this program; INSTALLED of one that says of which package it is."""
    said = law if isinstance(law, dict) else dict(law)
    return INSTALLED if "package" in said else str(said.get("name"))


def _choose_law(names: str) -> Discriminator:
    """What tells laws apart, with the names of those of this program."""
    message = f"there is no law of this name; there are {names}, and what installed packages offer"
    return Discriminator(_tag_law, custom_error_type="no_such_law", custom_error_message=message)


INSTALLED = "installed"


class Stomakhin(Settings):
    """The paper's: Stomakhin et al. (2013), with ``material.theta_c``, ``theta_s`` and ``xi``."""

    name: Literal["stomakhin"] = Field("stomakhin", description="the paper's material")


class CamClay(Settings):
    """Cohesive Cam clay in Hencky strain, for porous snow: Gaume et al. (2018)."""

    name: Literal["cam_clay"] = Field(description="cohesive Cam clay")
    slope: float = Field(gt=0, le=3, description="M, slope of the critical state line q = M p in the plane [1]")
    cohesion: float = Field(ge=0, le=1, description="beta, tensile over compressive strength [1]")
    strength: float = Field(gt=0, description="p_0, isotropic compressive strength before sintering [Pa]")
    hardening: float = Field(ge=0, le=6, description="growth of the cap with plastic volume [1]")
    cap: Literal["sinh", "exp"] = Field(description="how the cap grows")
    sintered: Literal["cap", "nothing"] = Field(description="what grows with xi of Eq. 9, beside the moduli of Eq. 7")


class Sand(Settings):
    """Drucker-Prager in Hencky strain with softening cohesion, for snow as grains: Klar et al. (2016)."""

    name: Literal["sand"] = Field(description="Drucker-Prager sand")
    friction_angle: float = Field(gt=0, lt=90, description="of internal friction [degrees]")
    cohesion: float = Field(ge=0, description="c, isotropic tensile strength before sintering and flow [Pa]")
    softening: float = Field(ge=0, le=1e6, description="loss of cohesion with plastic strain [1]")
    sintered: Literal["cohesion", "nothing"] = Field(
        description="what grows with xi of Eq. 9, beside the moduli of Eq. 7"
    )


MaterialChoice = Annotated[
    Annotated[Stomakhin, Tag("stomakhin")]
    | Annotated[CamClay, Tag("cam_clay")]
    | Annotated[Sand, Tag("sand")]
    | Annotated[InstalledLaw, Tag(INSTALLED)],
    _choose_law("stomakhin, cam_clay, sand"),
]


class PaperRates(Settings):
    """The paper's: Eqs. 2, 7 and 9, with ``sintering.C1`` to ``C5``."""

    name: Literal["paper"] = Field("paper", description="the paper's sintering")


class ConstantRates(Settings):
    """Constant rates, whatever presses: a constant, as the paper says of Takahashi's; Eq. 7 as in the paper."""

    name: Literal["constant"] = Field(description="constant rates")
    rate: float = Field(ge=0, description="of density over density [1/s]")
    hardening_rate: float = Field(ge=0, description="of xi [1/s]")


class MaenoRates(Settings):
    """Density by the fastest of Maeno and Ebinuma's mechanisms, or by settling; Eqs. 7 and 9 as in the paper."""

    name: Literal["maeno"] = Field(description="mechanisms of pressure sintering")
    temperature: float = Field(gt=200, le=273.15, description="of the snow, the same everywhere and always [K]")
    grain: float = Field(gt=0, le=0.02, description="diameter of the grains [m]")
    settles_below: float = Field(ge=0, le=917, description="density below which snow settles as Crocus has it [kg/m^3]")
    time_lapse: float = Field(gt=0, description="seconds of real sintering in a second of the simulation [1]")


SinteringChoice = Annotated[
    Annotated[PaperRates, Tag("paper")]
    | Annotated[ConstantRates, Tag("constant")]
    | Annotated[MaenoRates, Tag("maeno")]
    | Annotated[InstalledLaw, Tag(INSTALLED)],
    _choose_law("paper, constant, maeno"),
]
