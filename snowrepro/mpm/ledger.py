"""A run's ledger as tables, for who computes and who reads: the accounts of a frame, and the works made of them.

The kinetic + elastic energy changes in a frame by the works of CAUSES, each what one cause gave to the snow, and by
``unclosed_energy``, the rest.  All causes are measured where they act, so the rest is not there by construction: it is
the error of stepping in time.  Of the order of the time step but on nodes that the floor holds: docs/solver.md, "Energy
that the time step makes".

A new cause takes an entry in ACCOUNTS, its name in an entry of CAUSES, and the line in ``steps`` that books what it
gives, where it acts.  Fields, their clearing, TOTALS, diagnostics and the report's list follow.  One that changes the
velocity of particles behind the grid (step 8) is also among what ``transfer_work`` takes.

What reads a run needs no other module of the solver, and this one does without Taichi.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from ..settings.case import Case

ENERGY, MOMENTUM = "M L2/T2", "M L/T"  # units in powers of length, mass and time
PARTICLE, NODE, FRAME = "particle", "node", "frame"  # who keeps an account


@dataclass(frozen=True)
class Account:
    """What is booked of one cause in a frame.

    ``keeper``: PARTICLE or NODE, each with a field that ``steps`` books in; or FRAME, which ``diagnostics`` finds from
    where the frame began and ended.  ``shape``: () scalar, (2,) vector.  ``total``: the sum that it goes into where
    that has another name; a sum of vectors is two, by axis.
    """

    name: str
    keeper: str
    long_name: str
    unit: str = ENERGY
    shape: tuple[int, ...] = ()
    total: str = ""

    @property
    def totals(self) -> tuple[str, ...]:
        """The names in TOTALS that it is added to, one for each component."""
        name = self.total or self.name
        return tuple(f"{name}_{axis}" for axis in "xy") if self.shape else (name,)


@dataclass(frozen=True)
class Cause:
    """What gives energy to the snow: the ``name`` of its work in a run's file, and its ``label`` in a picture.

    The work is the sum of the accounts in ``adds`` less those in ``takes``, in the order that they stand in.
    """

    name: str
    label: str
    long_name: str
    adds: tuple[str, ...]
    takes: tuple[str, ...] = ()

    def work(self, booked: Mapping[str, float]) -> float:
        """The work, of what each account came to: plain additions in order, as sum() of Python 3.12 has other bits."""
        first, *others = self.adds
        work = booked[first]
        for name in others:
            work += booked[name]
        for name in self.takes:
            work -= booked[name]
        return work


ACCOUNTS = (
    Account("pressing_work", PARTICLE, "work of the external force b"),
    Account("sintering_work", PARTICLE, "energy by sintering (Eqs. 2 to 9)"),
    Account("plastic_work", PARTICLE, "energy by plastic flow"),
    Account("hardening_work", PARTICLE, "energy by the change of Eq. 1's factor"),
    Account("sliding_work", PARTICLE, "energy by step 8, collision with the floor"),
    Account("lifting_work", PARTICLE, "energy by being moved out of the floor"),
    Account("kinetic_work", NODE, "kinetic energy by all that acts on nodes"),
    Account("damping_work", NODE, "energy by damping"),
    Account("contact_work", NODE, "energy by step 5, collision with the floor"),
    Account("sliding_impulse", PARTICLE, "momentum by step 8, collision with the floor", MOMENTUM, (2,), "impulse"),
    Account("contact_impulse", NODE, "momentum by step 5, and by damping", MOMENTUM, (2,), "impulse"),
    Account("potential_drop", FRAME, "weight times the way that the centre of mass fell"),
    Account("kinetic_gain", FRAME, "kinetic energy gained since the frame began"),
    Account("kinetic_stop", FRAME, "kinetic energy that stopping at release took"),
)

CAUSES = (
    Cause(
        "pressing_work", "pressing force b", "work of the external force b in the frame",
        adds=("pressing_work",),
    ),
    Cause(
        "gravity_work", "gravity", "work of gravity in the frame",
        adds=("potential_drop",),
    ),
    Cause(
        "sintering_work", "sintering", "energy that sintering put in, as moduli, xi and volume changed, in the frame",
        adds=("sintering_work",),
    ),
    Cause(
        "plastic_work", "plastic flow", "elastic energy that plastic flow took (negative) in the frame",
        adds=("plastic_work",),
    ),
    Cause(
        "hardening_work", "hardening (Eq. 1)", "energy that the changing factor of Eq. 1 put in, in the frame",
        adds=("hardening_work",),
    ),
    Cause(
        "floor_work", "floor", "work of the floor, by contact, friction and moving particles out, in the frame",
        adds=("contact_work", "sliding_work", "lifting_work"),
    ),
    Cause(
        "damping_work", "damping", "work of damping and of stopping at release, in the frame",
        adds=("damping_work",), takes=("kinetic_stop",),
    ),
    # The motion gained, without what nodes got on the grid and what particles got behind it.
    Cause(
        "transfer_work", "particle-grid transfer",
        "kinetic energy lost (negative) between particles and grid in the frame",
        adds=("kinetic_gain",), takes=("kinetic_work", "sliding_work"),
    ),
)  # fmt: skip
WORKS = tuple(cause.name for cause in CAUSES)

# What a frame's energy and momentum come to, as ``accounts.fill_totals`` finds them: at its end, and by account.
ENERGIES = ("kinetic_energy", "elastic_energy")
TOTALS = tuple(
    dict.fromkeys((*ENERGIES, *(name for account in ACCOUNTS if account.keeper != FRAME for name in account.totals)))
)


def accounts_of(keeper: str) -> tuple[Account, ...]:
    """The accounts of one keeper, in the table's order."""
    return tuple(account for account in ACCOUNTS if account.keeper == keeper)


# Name of each diagnostic: long name, unit in powers of length, mass and time.
MEANING = {
    "substeps": ("substeps of the frame", "1"),
    "smallest_step": ("smallest time step of the frame", "T"),
    "total_mass": ("mass of all particles", "M"),
    "momentum_x": ("horizontal momentum", MOMENTUM),
    "momentum_y": ("vertical momentum", MOMENTUM),
    "unclosed_momentum_x": ("horizontal momentum that no cause explains", MOMENTUM),
    "unclosed_momentum_y": ("vertical momentum that no cause explains", MOMENTUM),
    "kinetic_energy": ("kinetic energy of the particles, their affine motion included", ENERGY),
    "elastic_energy": ("elastic energy of F_E", ENERGY),
    **{cause.name: (cause.long_name, ENERGY) for cause in CAUSES},
    "unclosed_energy": ("energy that no cause explains: the error of stepping in time, in the frame", ENERGY),
    "gravitational_energy": ("potential energy above y = 0 under the gravity of the frame", ENERGY),
    "top_speed": ("largest particle speed", "L/T"),
    "mean_density": ("mean density of Eq. 2", "M/L3"),
    "mean_young": ("mean Young's modulus before hardening", "M/L/T2"),
    "mean_hardening": ("mean hardening coefficient xi", "1"),
    "mean_factor": ("geometric mean of the hardening factor of Eq. 1", "1"),
    "centre_height": ("height of the centre of mass", "L"),
    "body_height": ("height of the middle nine tenths of the mass", "L"),
    "poisson_capped": ("particles at the cap of Poisson's ratio", "1"),
    "density_capped": ("particles at the maximum density", "1"),
    "hardening_capped": ("particles at the highest exponent of Eq. 1", "1"),
    "hardening_floored": ("particles at the lowest exponent of Eq. 1", "1"),
    "volume_bounded": ("particles at a bound of J_P", "1"),
    "ended_inside": ("times in the frame that a particle ended inside the floor", "1"),
}

# What runs with an indenter have beside.
INDENTER = {
    "indenter_depth": ("depth of the indenter below first touch, at the end of the frame", "L"),
    "indenter_force": ("upward force on the indenter at unit depth out of the plane, mean over the frame", "M L/T2"),
}

BOUNDED = ("poisson_capped", "density_capped", "hardening_capped", "hardening_floored", "volume_bounded")


def meaning(case: Case) -> dict[str, tuple[str, str]]:
    """The diagnostics of a run, as in MEANING."""
    return {**MEANING, **INDENTER} if case.indenter else MEANING


def unclosed_share(dataset: xr.Dataset) -> float:
    """Energy that no cause explains, frame by frame without sign, as a part of what the causes gave and took."""
    turned_over = float(sum(abs(dataset[name]).sum() for name in WORKS))
    return float(abs(dataset["unclosed_energy"]).sum()) / turned_over if turned_over else 0.0


def bounded(dataset: xr.Dataset) -> list[str]:
    """One line for each bound of the reading that acted: on how many particles at most, from which frame."""
    lines = []
    for name in BOUNDED:
        counts = dataset[name].values
        if counts.any():
            first = int(dataset.frame[counts > 0][0])
            lines.append(f"{dataset[name].long_name}: up to {int(counts.max())}, first in frame {first}")
    return lines
