"""The report on the paper's numbers, the page on reproducibility, and the cards of models and data set."""
