"""Defects drawn at random: what is changed and what is left, and that those of the list can still be made."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "mutation"))

import changes
import mutation

TEXT = '''"""Not 1 + 1."""
from somewhere import there
ρ = 2.0  # no letter of a single byte
def f(a: int = 3, b: "list[1]" = (), *, up=True):
    """Not a < b."""
    if not a:
        raise ValueError(f"{a + 1} is 1 + 1")
    where = there / "a" + "b"
    b[1] = max(-a, 7)
    return ρ * a <= b[0] and up
'''
WANTED = {
    "ρ = 4.0", "a: int = 4", "up=False", "if a:", "if (not (not a)):", "        pass", "    pass", "b[2] =", "b[0] =",
    "min(-a, 7)", "max(a, 7)", "max(7, -a)", "max(-a, 8)", "ρ / a", "a < b", "a > b", "b[1] and", "b[0] or up",
}  # fmt: skip


def test_numbers_signs_bounds_and_statements_are_changed_and_nothing_that_people_or_type_checkers_read():
    made = changes.find_changes(TEXT)
    assert all(changes.says_something_else(TEXT, change) for change in made)
    assert all(any(wanted in change.new for wanted in WANTED) for change in made), [c.new for c in made]
    assert {wanted for wanted in WANTED if any(wanted in change.new for change in made)} == WANTED
    assert len(made) == len(WANTED)


def test_a_line_that_stands_twice_is_told_by_the_lines_before_it():
    text = "def f(a):\n    a += 1\n    b = a\n    a += 1\n    return a\n"
    lines = [change.old for change in changes.find_changes(text) if change.operator == "statement"]
    assert lines == ["def f(a):\n    a += 1", "    b = a\n    a += 1"]


def test_what_is_the_same_in_other_words_or_no_python_is_no_change():
    assert not changes.says_something_else("a = 1\n", changes.Change(1, "", "a = 1", "a = (1)"))
    assert not changes.says_something_else("a = 1\n", changes.Change(1, "", "a = 1", "a = )"))


def test_a_seed_draws_the_same_lines_and_another_seed_others():
    one, same, other = (mutation.draw_mutants("laws", seed, 5) for seed in (3, 3, 4))
    assert one == same and len(one) == 5
    assert {mutant.name for mutant in one} != {mutant.name for mutant in other}


def test_each_change_of_the_list_can_still_be_made():
    """Else its lines were changed since: draw them anew, or correct ``old`` and ``new``."""
    package = mutation.REPOSITORY / "snowrepro"
    drawn = mutation.read_drawn()
    assert len(drawn) >= 40
    assert not [m.name for m in drawn if (package / m.file).read_text("utf-8").count(m.old) != 1]


def test_the_table_tells_what_is_caught_explained_missed_and_not_known():
    drawn = [mutation.Drawn(f"laws/{name}", "laws/x.py", 1, "number", "a = 1 | 2", "a = 2 | 2") for name in "abcd"]
    drawn.append(mutation.Drawn("laws/e", "laws/x.py", 1, "number", "a = 1", "a = 2", "survived at first"))
    drawn.append(mutation.Drawn("laws/f", "laws/x.py", 1, "number", "a = 1", "a = 2", "equivalent: by name"))
    trials = [
        mutation.Trial("laws/a", "tests/laws/test_x.py::test_one - assert 1", True, 1.0),
        mutation.Trial("laws/b", "", True, 2.0),
        mutation.Trial("laws/c", "", False, 240.0, "tests/laws/test_x.py::test_long"),
        mutation.Trial("laws/d", "check: 2 of 9", True, 3.0),
        mutation.Trial("laws/e", "tests/laws/test_x.py::test_two", True, 1.0),
    ]
    lines = mutation.report_trials(drawn, {trial.name: trial for trial in trials})
    assert "| all | 6 | 1 | 1 | 1 | 1 | 1 | 1 |" in lines
    assert r"| laws/a | `a = 1 \| 2` | `a = 2 \| 2` | `laws/test_x.py::test_one` |" in lines
    assert lines[-4].endswith("| nothing in 240 s |") and lines[-1].endswith("| equivalent: by name |")
    assert lines[-2].endswith("| `laws/test_x.py::test_two`; survived at first |")
