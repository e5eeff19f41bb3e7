"""A figure or table whose result file is missing names the command that makes it."""

import pytest

from paper_figures.figures import figure_6, figure_7
from paper_figures.measurements import figure_accuracy_cost, figure_broad_band, figure_effects, figure_hard_cases
from paper_figures.tables import table_quartiles


@pytest.mark.parametrize("module", [figure_effects, figure_accuracy_cost, figure_hard_cases, figure_broad_band])
def test_a_missing_measurement_names_the_command_that_makes_it(module, tmp_path):
    with pytest.raises(FileNotFoundError, match="`make measure-"):
        module.main(tmp_path / "absent.json", tmp_path)


def test_a_missing_result_names_its_target(tmp_path):
    for module, target in ((figure_6, "figure-6"), (figure_7, "figure-7"), (table_quartiles, "table-quartiles")):
        with pytest.raises(FileNotFoundError, match=f"`make {target}` makes it"):
            module.main(tmp_path / "absent.json", tmp_path)
