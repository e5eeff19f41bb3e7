import os
import shutil
import subprocess

import pytest

import bem._support.provenance
from bem._support.provenance import git_revision


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_revision_is_of_this_repository(tmp_path, monkeypatch):
    repository = tmp_path / "project"
    repository.mkdir()
    for name in ("tracked.py", "installed.py"):
        shutil.copy(bem._support.provenance.__file__, repository / name)
    # Nothing of the user's settings, nor of a git that runs these tests.
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    author = ("-c", "user.name=A", "-c", "user.email=a@b.c")
    for arguments in (("init", "-q"), ("add", "tracked.py"), (*author, "commit", "-qm", "First")):
        subprocess.run(["git", *arguments], cwd=repository, check=True)

    def found(path):
        monkeypatch.setattr(bem._support.provenance, "__file__", str(path))
        return git_revision.__wrapped__()

    clean = found(repository / "tracked.py")
    assert len(clean) == 40
    (repository / "tracked.py").write_text("changed")
    assert found(repository / "tracked.py") == f"{clean}-dirty"
    assert found(repository / "installed.py") == "unknown"
    assert found(tmp_path / "outside.py") == "unknown"
