"""The commands for missing seeds train what the ranking looks for, and none that is there."""

import shlex
import tomllib

from typer.testing import CliRunner

from experiments.common import CONFIGS
from experiments.trainings import seed_commands
from experiments.trainings.ranking import EXPECTED
from surrogate.architectures.naming import paper_names
from surrogate.cli import app as cli
from surrogate.prediction.files import PUBLISHED

ROOT = PUBLISHED.parent


def lines(capsys, seeds):
    seed_commands.study(ROOT / "dataset.h5", seeds, CONFIGS)
    return capsys.readouterr().out.splitlines()


def test_every_missing_seed_has_a_line_that_the_command_line_understands(capsys, tmp_path):
    found = [line.split(" && ") for line in lines(capsys, tmp_path)]
    assert len(found) == EXPECTED * (len(paper_names()) + 4)
    trains = [shlex.split(steps[0]) for steps in found]
    labels = [words[words.index("--label") + 1] for words in trains]
    assert len(set(labels)) == len(labels)
    assert all(words[:2] == ["surrogate", "train"] for words in trains)
    # Every option exists; `--help` stops before anything is trained.
    assert CliRunner().invoke(cli.app, [*trains[0][1:], "--help"]).exit_code == 0
    settings = tomllib.loads((CONFIGS / "feature_sets.toml").read_text(encoding="utf-8"))
    features = [words for words, label in zip(trains, labels, strict=True) if label.startswith("features-")]
    assert [words[words.index("--features") + 1] for words in features] == [
        one for one in "ABCD" for _ in range(EXPECTED)
    ]
    assert {words[words.index("--epochs") + 1] for words in features} == {str(settings["epochs"])}
    made, copied, listed = found[labels.index("features-A-seed-0")][1:]
    assert all(step.endswith(f"{tmp_path}/features-A/seed-0") for step in (made, copied, listed))
    assert "test_errors.csv" in copied
    assert "weights" not in copied


def test_a_seed_that_is_there_has_no_line(capsys):
    text = "\n".join(lines(capsys, ROOT / "seeds"))
    published = [path.parent for path in (ROOT / "seeds").glob("*/seed-*/run.json")]
    assert published
    for folder in published:
        assert f"{folder.parent.name}-{folder.name} " not in text
