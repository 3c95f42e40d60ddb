"""What is written down of the code that made a result."""

import subprocess

from snowrepro.store import provenance


def test_the_commit_is_named_and_whether_the_code_is_that_of_it(tmp_path, monkeypatch):
    """In a clone of one file of code and one of notes; outside a clone nothing is known."""
    monkeypatch.setattr(provenance, "CLONE", tmp_path)
    assert provenance.provenance()["git_state"] == "unknown"

    def git(*words: str) -> str:
        who = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
        return subprocess.run(["git", "-C", tmp_path, *who, *words], check=True, capture_output=True, text=True).stdout

    (tmp_path / "snowrepro").mkdir()
    for name in ("snowrepro/law.py", "notes.md"):
        (tmp_path / name).write_text("one\n")
    git("init")
    git("add", ".")
    git("commit", "--message", "one")
    commit = git("rev-parse", "HEAD").strip()
    assert len(commit) == 40 and provenance.provenance()["git_state"] == commit
    (tmp_path / "notes.md").write_text("two\n")
    assert provenance.provenance()["git_state"] == commit
    (tmp_path / "snowrepro" / "law.py").write_text("two\n")
    assert provenance.provenance()["git_state"] == f"{commit} modified"
    assert provenance.git_changes() == ["snowrepro/law.py"]
