"""The report: each number of the paper beside ours."""
