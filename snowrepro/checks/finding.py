"""What one check found, and the exit code that all of them come to."""

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
    """One check.  ``measured`` and ``allowed`` are in words with their units; ``note`` says what else one must know."""

    tier: int
    name: str
    state: str
    measured: str
    allowed: str = ""
    note: str = ""
    seconds: float = 0.0

    @property
    def is_caught(self) -> bool:
        """Whether it says that something is wrong with the program."""
        return self.state in (REGRESSED, CONTRADICTED, FAILED)


def exit_code(findings: Sequence[Finding]) -> ExitCode:
    """The gravest that was found; what is missing counts also where nothing was looked at."""
    codes = {EXITS.get(finding.state, ExitCode.FINE) for finding in findings} or {ExitCode.INCOMPLETE}
    return next((code for code in WORST_FIRST if code in codes), ExitCode.FINE)


def within(tier: int, name: str, value: float, most: float, of: str) -> Finding:
    """A number that must not exceed a bound; NaN does."""
    state = OK if value <= most else REGRESSED
    return Finding(tier, name, state, f"{value:.2g} {of}", f"{most:.2g}")
