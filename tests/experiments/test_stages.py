from experiments.stages import describe, read_stages


def test_every_stage_says_its_hours():
    stages = read_stages()
    assert list(stages) == ["dataset", "models", "feature-sets", "data-efficiency", "paper"]
    assert describe("models", stages).startswith("stage 2 of 5, models: train the eighteen models")
    assert describe("models", stages).endswith("hours")
    assert describe("dataset", stages).endswith("3 minutes")
    assert describe("paper", stages, with_hours=False) == "stage 5 of 5, paper"
