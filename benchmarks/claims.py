"""How often the rules of conf/claims say REPRODUCED of what is not so, and how many seeds a rise needs.

    python benchmarks/claims.py [--quick] [--write]

Numbers are drawn by chance, with a fixed seed, and judged by the program's own rules; nothing is simulated.
--quick: few draws.  --write: also to benchmarks/claims.md.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from tables import format_table

from snowrepro.evidence.claims import (
    CONTRADICTED,
    REPRODUCED,
    ClaimValues,
    JudgedScene,
    Verdict,
    judge_values,
)
from snowrepro.evidence.scenes import judge_scenes
from snowrepro.settings.question import Claim, Claims

RESULTS = Path(__file__).with_name("claims.md")
DRAWS, FEW = 1000, 50
ALPHA = 0.05
SD = 0.02  # of the mass in lumps over the seeds, as in Figures 5 and 6
SEEDS, PRESSURES = (3, 5), (3, 5)
FAR = 10.0  # where it is plain on which side a number is [SD]
CORRELATION = 0.8  # of the scenes of a shape
STEPS, MORE_SEEDS = (1, 2, 3, 4, 6), (3, 5, 10)
WORDS = (REPRODUCED, CONTRADICTED)
NO_RUNS = pd.DataFrame()
OF_NULLS = (
    "No rule says REPRODUCED more often than alpha while seeds are normal: a flat or falling step is not carried by "
    "the others. A mean of skewed seeds that lies at the threshold is: three to five seeds do not show that they are "
    "skewed. That matters only where a number lies within its seeds of the threshold."
)
OF_SCENES = (
    "Four shapes that agree, whatever the number of their scenes, are as much as four tosses of a coin: one in "
    "sixteen, and more than alpha. So fewer shapes decide nothing, and no p is printed."
)
OF_POWER = (
    "With five pressures three seeds find a rise whose smallest step is six sd, five seeds one of three sd, ten seeds "
    "one of two sd. The sd of the mass in lumps over the seeds of Figures 5 and 6 (bonds, the grid of the paper) is up "
    "to 0.02: there three seeds find steps from about 0.1 on, ten from 0.04 on."
)


@dataclass(frozen=True)
class Null:
    """A truth under which a claim does not hold, or only just.

    ``name``: in words; ``test``: of the claim; ``threshold`` as in the claim; ``skewed``: whether seeds are exponential
    and not normal.
    """

    name: str
    test: str
    threshold: float = 0.0
    skewed: bool = False

    def list_means(self, pressures: int) -> np.ndarray:
        """List the true means at the pressures."""
        steps = np.full(pressures - 1, FAR * SD)
        if self.name == "flat":
            steps[:] = 0.0
        elif self.name == "flat first step":
            steps[0] = 0.0
        elif self.name == "a middle that falls by one sd":
            steps[(pressures - 1) // 2] = -SD
        elif self.name == "every step at the threshold":
            steps[:] = self.threshold
        if self.test == "rises":
            return np.concatenate([[0.0], np.cumsum(steps)])
        sides = np.zeros(pressures)
        if self.name == "one pressure at the threshold":
            sides[1:] = FAR * SD if self.test == "above" else -FAR * SD
        return self.threshold + sides


NULLS = (
    Null("flat", "rises"),
    Null("flat first step", "rises"),
    Null("a middle that falls by one sd", "rises"),
    Null("every step at the threshold", "rises", threshold=0.1),
    Null("every pressure at the threshold", "below", threshold=0.5),
    Null("one pressure at the threshold", "below", threshold=0.5),
    Null("one pressure at the threshold", "above", threshold=0.5),
    Null("one pressure at the threshold", "below", threshold=0.5, skewed=True),
    Null("one pressure at the threshold", "above", threshold=0.5, skewed=True),
)


def main() -> None:
    """Measure all rates and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few draws")
    parser.add_argument("--write", action="store_true", help=f"write {RESULTS.name} too")
    options = parser.parse_args()
    text = report_rates(FEW if options.quick else DRAWS)
    if options.write:
        RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def make_claim(test: str, threshold: float, name: str = "C", claims: tuple[str, ...] = ()) -> Claim:
    """Make a claim on the mass in lumps of sintered snow."""
    return Claim(
        name=name, statement="", paper="", measure="lump_fraction", test=test, threshold=threshold, claims=claims
    )  # fmt: skip


def measure_rates(null: Null, pressures: int, seeds: int, draws: int) -> tuple[float, float]:
    """Measure how often a null is called REPRODUCED, and CONTRADICTED."""
    return judge_draws(make_claim(null.test, null.threshold), null.list_means(pressures), seeds, draws, null.skewed)


def judge_draws(
    claim: Claim, means: np.ndarray, seeds: int, draws: int, is_skewed: bool = False
) -> tuple[float, float]:
    """Draw values (seeds, pressures) around true means and judge them; how often REPRODUCED, and CONTRADICTED."""
    rng = np.random.default_rng(0)
    size = (draws, seeds, len(means))
    noise = rng.exponential(size=size) - 1.0 if is_skewed else rng.normal(size=size)
    columns = np.arange(1.0, len(means) + 1)
    words = [
        judge_values(claim, ALPHA, ClaimValues(pd.DataFrame(values, columns=columns))).word
        for values in means + SD * noise
    ]
    reproduced, contradicted = (words.count(word) / draws for word in WORDS)
    return reproduced, contradicted


def measure_rates_of_scenes(shapes: int, floors: int, correlation: float, draws: int) -> tuple[float, float]:
    """Measure how often a claim that holds in each scene by the toss of a coin is called REPRODUCED, and CONTRADICTED.

    ``correlation``: of the scenes of a shape, of the normal numbers whose signs are the tosses.
    """
    rng = np.random.default_rng(0)
    claims = Claims(
        name="scenes", alpha=ALPHA,
        list=(make_claim("above", 0.0), make_claim("scenes", 0.5, "over", ("C",))),
    )  # fmt: skip
    words = []
    for _ in range(draws):
        shared, own = rng.normal(size=(shapes, 1)), rng.normal(size=(shapes, floors))
        margins = np.sqrt(correlation) * shared + np.sqrt(1 - correlation) * own
        scenes = [
            make_scene(f"shape{shape}", f"floor{floor}", margin) for (shape, floor), margin in np.ndenumerate(margins)
        ]
        words.append(judge_scenes(claims, scenes)[0].word)
    reproduced, contradicted = (words.count(word) / draws for word in WORDS)
    return reproduced, contradicted


def make_scene(shape: str, floor: str, margin: float) -> JudgedScene:
    """Make a scene whose one claim has this margin."""
    verdict = Verdict("C", "", REPRODUCED, agrees=bool(margin > 0), margin=float(margin), seeds=1)
    return JudgedScene(shape, floor, NO_RUNS, False, [verdict])


def report_rates(draws: int) -> str:
    """Write all tables as Markdown."""
    low, high = (format_rate(ALPHA + side * find_error(draws)) for side in (-2, 2))
    about = (
        "The rules of [`conf/claims/paper.yaml`](../conf/claims/paper.yaml) on numbers drawn by chance, where the "
        f"claim does not hold, or only just: {draws:,} draws each, seeds normal with an sd of {SD:g} (skewed: "
        "exponential). First the share of draws that are called REPRODUCED, then CONTRADICTED, in %. Alpha is "
        f"{ALPHA:.0%}: by chance such a rate comes out between {low} and {high} here. "
        "`python benchmarks/claims.py --write` makes this page."
    )
    lines = [
        "# How often a claim is called reproduced that is not so",
        "",
        about,
        "",
        *tabulate_nulls(draws),
        "",
        OF_NULLS,
    ]
    about = "A claim agrees with each scene as a coin falls, and the coins of a shape correlate."
    lines += ["", "## Over scenes", "", about, "", *tabulate_scenes(draws), "", OF_SCENES]
    about = (
        "All steps are alike. The share of draws that are called REPRODUCED, in %, by the size of a step in sd of the "
        "seeds at one pressure."
    )
    lines += ["", "## How many seeds a rise needs", "", about, "", *tabulate_power(max(draws // 4, 20)), "", OF_POWER]
    return "\n".join(lines) + "\n"


def tabulate_nulls(draws: int) -> list[str]:
    """Tabulate the rates of all nulls by the numbers of pressures and seeds."""
    sizes = [(pressures, seeds) for pressures in PRESSURES for seeds in SEEDS]
    rows = [
        [
            null.test,
            null.name + (", skewed seeds" if null.skewed else ""),
            *(format_pair(measure_rates(null, pressures, seeds, draws)) for pressures, seeds in sizes),
        ]
        for null in NULLS
    ]
    heads = [f"{pressures} pressures, {seeds} seeds" for pressures, seeds in sizes]
    return format_table(["test", "truth", *heads], rows)


def tabulate_scenes(draws: int) -> list[str]:
    """Tabulate the rates of a toss of coins by the numbers of shapes and scenes."""
    rows = [
        [f"{shapes} shapes of {floors} scenes", *(format_pair(rates) for rates in by_correlation)]
        for shapes, floors in ((3, 7), (4, 1), (4, 7), (6, 7))
        for by_correlation in [[measure_rates_of_scenes(shapes, floors, r, draws) for r in (0.0, CORRELATION)]]
    ]
    return format_table(["scenes", "no correlation", f"correlation {CORRELATION:g}"], rows)


def tabulate_power(draws: int) -> list[str]:
    """Tabulate how often a rise is found, by the size of its steps and the numbers of pressures and seeds."""
    sizes = [(pressures, seeds) for pressures in PRESSURES for seeds in MORE_SEEDS]
    claim = make_claim("rises", 0.0)
    rows = [
        [
            f"{step} sd",
            *(
                format_rate(judge_draws(claim, step * SD * np.arange(pressures), seeds, draws)[0])
                for pressures, seeds in sizes
            ),
        ]
        for step in STEPS
    ]
    return format_table(["step", *(f"{pressures} pressures, {seeds} seeds" for pressures, seeds in sizes)], rows)


def find_error(draws: int) -> float:
    """Find the standard error of a rate of alpha."""
    return float(np.sqrt(ALPHA * (1 - ALPHA) / draws))


def format_pair(rates: Sequence[float]) -> str:
    """Write the rates of REPRODUCED and CONTRADICTED."""
    return " / ".join(map(format_rate, rates))


def format_rate(rate: float) -> str:
    """Write a rate in per cent."""
    return f"{100 * rate:.1f}"


if __name__ == "__main__":
    main()
