"""What each option file says is pinned: a changed number is noticed, with the file that it is in.

To renew the digests on purpose: ``python -m tests.test_options``; the change of ``options.json`` is then reviewed.
"""

import hashlib
import json
from pathlib import Path

import yaml

from snowrepro.composition.experiments import CONF_DIR

PINNED = Path(__file__).with_name("options.json")
RENEW = "if that is meant: python -m tests.test_options"


def take_digests(folder: Path = CONF_DIR) -> dict[str, str]:
    """The digest of what each file in and below the folder says, by its name; comments and layout do not count."""
    files = sorted(path for path in folder.glob("**/*.yaml") if "experiment" not in path.relative_to(folder).parts)
    files += sorted((folder / "experiment").glob("*.yaml"))  # a link, which ** does not follow
    return {str(path.relative_to(folder).with_suffix("")): digest(path) for path in files}


def digest(path: Path) -> str:
    """The digest of what a file says."""
    said = yaml.safe_load(path.read_text(encoding="utf-8"))
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]


def list_changes(pinned: dict[str, str], now: dict[str, str]) -> list[str]:
    """The options that came, went or say something else, a line each."""
    came = [f"{name} is new" for name in now.keys() - pinned.keys()]
    went = [f"{name} is gone" for name in pinned.keys() - now.keys()]
    changed = [f"{name} says something else" for name in pinned.keys() & now.keys() if pinned[name] != now[name]]
    return sorted(came + went + changed)


def test_no_option_changed():
    """Each file of each group, experiments with their variants too."""
    changes = list_changes(json.loads(PINNED.read_text()), take_digests())
    assert not changes, f"{'; '.join(changes)} ({RENEW})"


def test_all_options_are_pinned():
    """In every group that a run is composed of."""
    groups = {name.partition("/")[0] for name in take_digests()}
    assert groups >= {path.name for path in CONF_DIR.iterdir() if path.is_dir()}
    paths = [path for pattern in ("*.yaml", "*/*.yaml", "hydra/*/*.yaml") for path in CONF_DIR.glob(pattern)]
    assert len(take_digests()) == len(paths)


def test_a_number_that_changes_is_named(tmp_path):
    """And a comment is nothing."""
    for group, text in (("floor", "name: L\nwidth: 200\n"), ("shape", "name: ball\n")):
        (tmp_path / group).mkdir()
        (tmp_path / group / "one.yaml").write_text(text)
    before = take_digests(tmp_path)
    (tmp_path / "shape" / "one.yaml").write_text("# the same\nname:   ball\n")
    assert list_changes(before, take_digests(tmp_path)) == []
    (tmp_path / "floor" / "one.yaml").write_text("name: L\nwidth: 210\n")
    (tmp_path / "floor" / "two.yaml").write_text("name: M\n")
    assert list_changes(before, take_digests(tmp_path)) == ["floor/one says something else", "floor/two is new"]


if __name__ == "__main__":
    PINNED.write_text(json.dumps(take_digests(), indent=1) + "\n", encoding="utf-8")
