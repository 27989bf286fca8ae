"""The tables of the paper, and what explains them."""
