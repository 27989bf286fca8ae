"""Motion and parameters together: maximum likelihood."""
