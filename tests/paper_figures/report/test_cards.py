"""The cards and the metadata beside the published files are those that `make cards` writes."""

import json
import shutil

import pytest

from paper_figures.report import cards
from surrogate.files import PUBLISHED as MODELS

PUBLISHED = MODELS.parent
FOLDERS = ("models/M1-concat", "models/M1-concat-large", "pretrained/fast", "pretrained/accurate")
"""A model of the paper, one trained on further data too, and pretrained ones."""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Copies of some published files, whose cards and metadata are written anew."""
    folder = tmp_path_factory.mktemp("published")
    for name in FOLDERS:
        shutil.copytree(PUBLISHED / name, folder / name, ignore=shutil.ignore_patterns("README.md"))
    for name in ("dataset.h5", "models/trainings.h5"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(PUBLISHED / name, folder / name)
    cards.main(folder)
    return folder


@pytest.mark.parametrize(
    "name", ["pretrained/fast/README.md", "pretrained/accurate/README.md", "README.md", cards.METADATA]
)
def test_a_card_is_of_the_published_files(name, written):
    """Fails when a model or the data set was published anew: run `make cards`."""
    assert (written / name).read_text(encoding="utf-8") == (PUBLISHED / name).read_text(encoding="utf-8")


def test_the_models_page_is_of_these_models(written):
    head, *sections = (PUBLISHED / "models/README.md").read_text(encoding="utf-8").split("\n## ")
    assert [section.partition("\n")[0] for section in sections] == sorted(
        path.parent.name for path in MODELS.glob("*/run.json")
    )
    again, *two = (written / "models/README.md").read_text(encoding="utf-8").split("\n## ")
    assert again == head
    assert {text.strip() for text in two} <= {text.strip() for text in sections}
    assert ["another data set" in section for section in two] == [False, True]


def test_the_metadata_are_valid_croissant(written):
    croissant = pytest.importorskip("mlcroissant")
    metadata = croissant.Dataset(jsonld=str(written / cards.METADATA)).metadata
    assert (metadata.ctx.issues.errors, metadata.ctx.issues.warnings) == (set(), set())
    broken = json.loads((written / cards.METADATA).read_text())
    del broken["distribution"][0]["contentUrl"]
    with pytest.raises(croissant.ValidationError):
        croissant.Dataset(jsonld=broken)
