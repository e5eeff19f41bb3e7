"""The hard cases: which they are, and what is said of one."""

import re

from bem.protocol import default_start_indentation
from experiments.robustness import hard_cases


def test_hard_cases_are_different_and_never_too_deep_for_a_large_tabor_parameter():
    cases = hard_cases.random_combinations(400, 1)
    assert len({tuple(case.values()) for case in cases}) == 400
    assert max(case["peak_indentation"] for case in cases if case["tabor"] > 1.0) == 100.0
    assert all(case["peak_indentation"] > default_start_indentation(case["tabor"]) for case in cases)
    assert {case["peak_indentation"] for case in cases} == {
        *hard_cases.VALUES["peak_indentation"],
        hard_cases.SHALLOWEST,
    }
    assert len(hard_cases.corners()) == 32


def test_a_hard_case_is_examined_and_summarised():
    case = dict(zip(hard_cases.VALUES, (1.0, 0.1, 10.0, 10.0, 0.0, 0.5), strict=True))
    row = hard_cases.examined({"kind": "random", **case})
    assert row["status"] == row["refined_status"] == "completed"
    assert row["change"] < 4e-3
    text = hard_cases.markdown([row], {"command": "c", "host": "h"})
    assert "| completed with finite numbers | 1 |" in text
    assert re.search(r"^\| loops that create energy \(.*\) \| 0 \|", text, flags=re.MULTILINE)
