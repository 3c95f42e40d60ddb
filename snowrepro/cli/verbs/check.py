"""``snowrepro check``: say whether results are what they were, and as promised."""

import argparse
from pathlib import Path

from ... import text
from ...checks import check, finding, mutants, outputs
from ...errors import ExitCode
from ...store import files, provenance
from ...sweep import processes
from .. import checking, screen
from ..arguments import add_checked

HELP = """\
Does the program still give what it gave, and what it promises?

  tier 0  invariances: same bits twice, after a restart, mirrored, in other units, ...; needs no reference
  tier 1  fingerprints: the bits of short runs; other bits, or a platform without a fingerprint, go on to tier 2
  tier 2  short horizon: the same numbers, within what rounding was measured to do
  tier 3  ensemble: Figure 5, coarse, several seeds, pair by pair beside the reference's
  tier 4  the paper's claims: the same verdicts

Writes check.json, check.xml (JUnit) and check.md (for a pull request).  What was computed is kept: stopped, the same
command goes on.

examples:
  snowrepro check                       all tiers, at a size for continuous integration
  snowrepro check --tier 0,1,2          a minute or two
  snowrepro check --full                more seeds, and Figure 5 at the paper's fidelity
  snowrepro check --mutants             do the tiers notice defects, and leave harmless changes alone?

exit codes: 0 fine, 1 regressed or contradicted, 2 bad input, 3 runs failed, 4 incomplete or nothing measured,
130 interrupted
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is to be checked, and where the findings go."""
    parser.add_argument("--full", action="store_true", help="more seeds, and Figure 5 at the paper's fidelity")
    parser.add_argument(
        "--mutants",
        action="store_true",
        help="show deliberate defects and harmless changes of the program to the tiers",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FOLDER",
        help="of the files that are written (default: my_reports/check, of --mutants my_reports/mutants)",
    )  # fmt: skip
    add_checked(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Run the tiers, say each finding as it comes, and write them for others to read."""
    request = checking.read_options(options)
    folder = options.out or Path("my_reports/mutants" if options.mutants else "my_reports/check")
    for written in (folder, Path(options.store)):
        files.require_writable(written)
    if options.mutants:
        return _try_mutants(options, folder)
    findings: list[finding.Finding] = []
    for new in check.run_checks(request):
        findings.append(new)
        outputs.write_findings(findings, _describe_check(options), folder, finished=False)
        for line in outputs.format_next(new, findings[:-1]):
            print(text.make_printable(line), flush=True)
    outputs.write_findings(findings, _describe_check(options), folder)
    print("", outputs.summarise_findings(findings), sep="\n")
    screen.say(f"written: {', '.join(str(folder / name) for name in outputs.FILES)}")
    return finding.choose_exit_code(findings)


def _try_mutants(options: argparse.Namespace, folder: Path) -> ExitCode:
    """Show deliberate changes of the program to the tiers, and say what was noticed."""
    chosen = mutants.read_mutants()
    trials = []
    workers = options.workers or processes.usable_cores()
    for trial in mutants.try_mutants(chosen, options.baseline, Path(options.store), options.full, workers):
        trials.append(trial)
        screen.say(f"[{len(trials)}/{len(chosen)}] {trial.verdict}: {trial.mutant.name} {trial.problem}")
    mutants.write_trials(trials, _describe_check(options), folder)
    print("\n".join(mutants.list_wrong_trials(trials)))
    screen.say(f"written: {folder}")
    return mutants.choose_exit_code(trials)


def _describe_check(options: argparse.Namespace) -> dict[str, str]:
    """What was checked, with what and by which program: for the head of the findings."""
    return {"full": str(options.full).lower(), "baseline": str(options.baseline), **provenance.provenance()}
