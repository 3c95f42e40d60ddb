"""The finding of one check, and the exit code for all findings together."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import ExitCode

OK = "ok"
MOVED = "moved"  # other bits than the reference, or none for this platform: tier 2 decides whether that matters
REGRESSED = "REGRESSED"
CONTRADICTED = "CONTRADICTED"
FAILED = "RUN FAILED"
NOT_MEASURED = "NOT MEASURED"

EXITS = {REGRESSED: ExitCode.REGRESSED, CONTRADICTED: ExitCode.REGRESSED, FAILED: ExitCode.RUNS_FAILED,
         NOT_MEASURED: ExitCode.INCOMPLETE}  # fmt: skip
WORST_FIRST = (ExitCode.REGRESSED, ExitCode.RUNS_FAILED, ExitCode.INCOMPLETE)
TIERS = {
    0: "invariances",
    1: "fingerprints",
    2: "short horizon",
    3: "ensemble of seeds",
    4: "the paper's claims",
}


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    ``measured``, ``allowed``: in words with their units; ``note``: what else a reader must know.
    """

    tier: int
    name: str
    state: str
    measured: str
    allowed: str = ""
    note: str = ""
    seconds: float = 0.0

    @property
    def is_caught(self) -> bool:
        """Whether the finding says that something is wrong with the program."""
        return self.state in (REGRESSED, CONTRADICTED, FAILED)


def choose_exit_code(findings: Sequence[Finding]) -> ExitCode:
    """Choose the exit code of the gravest finding; no finding at all counts as incomplete."""
    codes = {EXITS.get(finding.state, ExitCode.FINE) for finding in findings} or {ExitCode.INCOMPLETE}
    return next((code for code in WORST_FIRST if code in codes), ExitCode.FINE)


def check_bound(tier: int, name: str, value: float, most: float, of: str) -> Finding:
    """Check that a number does not exceed a bound (NaN does); ``of``: its unit and meaning in words."""
    state = OK if value <= most else REGRESSED
    return Finding(tier, name, state, f"{value:.2g} {of}", f"{most:.2g}")
