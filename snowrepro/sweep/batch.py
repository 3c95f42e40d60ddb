"""A job array for Slurm: each task does its part of a sweep and ends; nothing waits for them."""

import shlex
import sys
from pathlib import Path

from ..composition.overrides import override_folder
from ..errors import ConfigError
from ..store.files import published
from . import record
from .estimate import estimate
from .plan import Plan
from .todo import Todo

SLACK = 3.0  # a task may take so many times what is expected
LEAST_MINUTES, MEMORY_SLACK_MB = 10, 300

SCRIPT = """\
#!/bin/bash
# {count} of the runs of the sweep '{name}', in {tasks} tasks.  Submit it with: sbatch {path}
# Submit it again to go on with what was stopped: what is done is not done again.
#SBATCH --job-name=snowrepro-{name}
#SBATCH --array={array}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem={memory}M
#SBATCH --time={minutes}
#SBATCH --signal=B:TERM@60
#SBATCH --output={log}
cd {folder}
exec {command} --part "$SLURM_ARRAY_TASK_ID/{parts}"
"""


def write_script(path: Path, plan: Plan, todo: Todo, most_tasks: int) -> None:
    """Write the script that runs what is to be run of a sweep, and remember the sweep.

    Raises ConfigError where there is nothing to run or ``most_tasks`` is no number of tasks.
    """
    if most_tasks < 1:
        raise ConfigError(f"tasks: should be at least 1 (got {most_tasks})")
    if not todo.to_run:
        raise ConfigError("nothing is to be run: no script was written")
    parts = min(len(plan.planned), most_tasks)
    place = {id(planned): index % parts + 1 for index, planned in enumerate(plan.planned)}
    tasks: dict[int, list] = {}
    for decision in todo.to_run:
        tasks.setdefault(place[id(decision.planned)], []).append(decision.planned.run.case)
    store = plan.runs[0].store
    longest = max(tasks.values(), key=len)
    folder = record.write_record(plan)
    words = [*plan.overrides, "hydra.launcher.workers=1"]
    from_root = override_folder("store", str(Path(store).resolve()))
    words = [from_root if word.startswith("store=") else word for word in words]
    text = SCRIPT.format(
        count=len(todo.to_run),
        name=folder.name,
        tasks=len(tasks),
        path=path,
        array=ranges(sorted(tasks)),
        memory=round(estimate((d.planned.run.case for d in todo.to_run), store).memory_mb + MEMORY_SLACK_MB),
        minutes=max(LEAST_MINUTES, round(SLACK * estimate(longest, store).seconds / 60)),
        log=shlex.quote(str((folder / "slurm-%a.log").resolve())),
        folder=shlex.quote(str(Path.cwd())),
        command=shlex.join([sys.executable, "-m", "snowrepro", "run", "-m", *words]),
        parts=parts,
    )
    with published(path) as partial:
        partial.write_text(text, encoding="utf-8")
        partial.chmod(0o755)


def ranges(numbers: list[int]) -> str:
    """Rising numbers as Slurm writes them: 1-3,7."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ",".join(f"{first}-{last}" if last > first else str(first) for first, last in spans)
