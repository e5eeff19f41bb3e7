import shutil
import subprocess

import bem.provenance
from bem.provenance import git_revision


def test_a_revision_is_that_of_the_repository_which_holds_this_package(tmp_path, monkeypatch):
    repository = tmp_path / "project"
    repository.mkdir()
    for name in ("tracked.py", "installed.py"):
        shutil.copy(bem.provenance.__file__, repository / name)
    author = ("-c", "user.name=A", "-c", "user.email=a@b.c")
    for words in (("init", "-q"), ("add", "tracked.py"), (*author, "commit", "-qm", "First")):
        subprocess.run(["git", *words], cwd=repository, check=True)

    def found(path):
        monkeypatch.setattr(bem.provenance, "__file__", str(path))
        return git_revision.__wrapped__()

    clean = found(repository / "tracked.py")
    assert len(clean) == 40
    (repository / "tracked.py").write_text("changed")
    assert found(repository / "tracked.py") == f"{clean}-dirty"
    assert found(repository / "installed.py") == "unknown"
    assert found(tmp_path / "outside.py") == "unknown"
